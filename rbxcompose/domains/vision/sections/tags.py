"""The section `tags`: what is known about tags, and the camera that looks for them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from rbxcompose.base.config import Name, Refers
from rbxcompose.base.findings import kind
from rbxcompose.domains.vision.known_tags import KnownTags
from rbxcompose.domains.vision.sections.cameras import CAMERA, cameras
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, WantedComponent, Wiring

TAGS = "tags"
WHICH_CAMERA = kind("RBX3722")


class TagsModel(KnownTags):
    """Tags, and the camera that looks for them."""

    camera: Annotated[Name, Refers(CAMERA)] | None = None
    """Which one of `cameras`. Default: the only one."""


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    if (found := contents.of(tags)) is None or found.camera is None:
        return
    from rbxcompose.domains.worlds.optics import optical_frame  # imports numpy

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
