"""The section `tags`: what is known about tags, and the camera that looks for them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from rbxcompose.base.config import Angle, Config, Length, Name, Refers
from rbxcompose.base.findings import kind
from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.domains.vision.sections.cameras import CAMERA, cameras
from rbxcompose.domains.worlds.optics import optical_frame
from rbxcompose.domains.worlds.tag_pictures import DEFAULT_FAMILY, TAG_FAMILIES, no_tag
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, WantedComponent, Wiring

TAGS = "tags"
WHICH_CAMERA = kind("RBX3722")


class BoardTag(Config):
    """A tag of a board, and where it is in the frame of that: x to its right, y up, z out of it."""

    number: int = Field(ge=0)
    """Its number."""
    x: Length = 0.0
    """Position along x."""
    y: Length = 0.0
    """Position along y."""
    z: Length = 0.0
    """Position along z."""
    roll: Angle = 0.0
    """Rotation about x, then pitch about y and yaw about z."""
    pitch: Angle = 0.0
    """Rotation about y."""
    yaw: Angle = 0.0
    """Rotation about z."""


class TagBoard(Config):
    """A board: tags that are fixed to each other."""

    tags: list[BoardTag] = Field(min_length=1)
    """Its tags."""

    @model_validator(mode="after")
    def _has_each_once(self) -> TagBoard:
        if len({tag.number for tag in self.tags}) < len(self.tags):
            raise ValueError("a board has each tag once")
        return self

    @property
    def places(self) -> dict[int, Transform3]:
        """Return where its tags are, by number."""
        return {
            tag.number: Transform3((tag.x, tag.y, tag.z), quaternion_from_rpy(tag.roll, tag.pitch, tag.yaw))
            for tag in self.tags
        }


class KnownTags(Config):
    """What is known about tags."""

    family: TAG_FAMILIES = DEFAULT_FAMILY
    """The family of the tags."""
    size: Length | None = Field(None, gt=0)
    """The side of the black square of a tag; without it, tags have no pose."""
    names: dict[Name, Annotated[int, Field(ge=0)]] = {}
    """Numbers of tags by name."""
    sizes: dict[Name, Annotated[Length, Field(gt=0)]] = {}
    """Sizes of tags with another `size`, by name."""
    boards: dict[Name, TagBoard] = {}
    """Boards by name."""

    @model_validator(mode="after")
    def _are_told_apart(self) -> KnownTags:
        errors = [InitErrorDetails(type=why, loc=place, input=None) for place, why in self._mistakes()]
        if errors:  # all of them at once, each at its place
            raise ValidationError.from_exception_data(TAGS, errors)
        return self

    def _mistakes(self) -> Iterator[tuple[tuple[str | int, ...], PydanticCustomError]]:
        first = dict[int, str]()
        numbers: dict[tuple[str | int, ...], int] = {("names", name): number for name, number in self.names.items()}
        for name, board in self.boards.items():
            numbers |= {("boards", name, "tags", at, "number"): tag.number for at, tag in enumerate(board.tags)}
            if name in self.names:
                yield ("boards", name), _mistake(f"a tag has the same name: {name}")
        for place, number in numbers.items():
            if why := no_tag(number, self.family):
                yield place, _mistake(why)
        for name, number in self.names.items():
            if first.setdefault(number, name) != name:
                yield ("names", name), _mistake(f"'{first[number]}' has the same number")
        for name in (name for name in self.sizes if name not in self.names):
            context = {"name": name, "valid": tuple(self.names), "what": "'names'"}
            yield ("sizes", name, "[key]"), PydanticCustomError("tag", "'names' has no tag '{name}'", context)


def _mistake(why: str) -> PydanticCustomError:
    return PydanticCustomError("value_error", "{error}", {"error": why})


class TagsModel(KnownTags):
    """Tags, and the camera that looks for them."""

    camera: Annotated[Name, Refers(CAMERA)] | None = None
    """Which one of `cameras`. Default: the only one."""


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    if (found := contents.of(tags)) is None or (camera := contents.of(cameras).get(found.camera or "")) is None:
        return
    config = {
        **{name: getattr(found, name) for name in KnownTags.model_fields},
        "image": f"{found.camera}/image_raw",
        "info": f"{found.camera}/camera_info",
        "frame": optical_frame(camera.frame),
    }
    yield WantedComponent(TAGS, "tag_detector", config, (TAGS,))


@section("tags", TagsModel, order=65, brings=(TAGS,), wires=True, components=_components)
def tags(reading: Reading[TagsModel]) -> TagsModel | None:
    """Tags that a camera looks for: their sizes and names, and boards of several; each with a name is a frame.

    Example:
        cameras: {front: {frame: base_footprint}}
        tags: {size: 12 cm, names: {dock: 3}}
    """
    if (read := reading.whole()) is None:
        return None
    known = [*cameras.names_in(reading.contents.root)]
    if read.camera is None and len(known) != 1:
        which = f"one of {', '.join(known)}" if known else "and 'cameras' has none"
        reading.report.add(WHICH_CAMERA.at(reading.key(TAGS), f"'tags' needs a 'camera': {which}"))
        return None
    return read if read.camera else read.model_copy(update={"camera": known[0]})
