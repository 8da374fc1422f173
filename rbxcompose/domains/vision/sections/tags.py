"""The section `tags`: what is known about tags, and the camera that looks for them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator, model_validator

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

    @field_validator("names", "boards")
    @classmethod
    def _are_of_family(cls, known: dict[str, int] | dict[str, TagBoard], info: ValidationInfo) -> Any:
        for one in known.values():
            for number in (one,) if isinstance(one, int) else one.places:
                if why := no_tag(number, info.data.get("family", DEFAULT_FAMILY)):
                    raise ValueError(why)
        return known

    @model_validator(mode="after")
    def _are_told_apart(self) -> KnownTags:
        if wrong := self.sizes.keys() - self.names:
            raise ValueError(f"'sizes' names tags that 'names' does not have: {', '.join(sorted(wrong))}")
        if len({*self.names.values()}) < len(self.names):
            raise ValueError("two 'names' have the same number")
        if wrong := self.names.keys() & self.boards.keys():
            raise ValueError(f"a tag and a board have the same name: {', '.join(sorted(wrong))}")
        return self


class TagsModel(KnownTags):
    """Tags, and the camera that looks for them."""

    camera: Annotated[Name, Refers(CAMERA)] | None = None
    """Which one of `cameras`. Default: the only one."""


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    if (found := contents.of(tags)) is None or found.camera is None:
        return
    camera = contents.of(cameras)[found.camera]
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
    known = reading.contents.of(cameras)
    if read.camera is None and len(known) != 1:
        which = f"one of {', '.join(known)}" if known else "and 'cameras' has none"
        reading.report.add(WHICH_CAMERA.at(reading.key(TAGS), f"'tags' needs a 'camera': {which}"))
        return None
    return read if read.camera else read.model_copy(update={"camera": next(iter(known))})
