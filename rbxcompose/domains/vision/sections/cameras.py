"""The section `cameras`: simulated or real, with the same topics."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from pydantic import Field

from rbxcompose.base.config import Angle, Config, Frequency, Length, Time
from rbxcompose.base.findings import Finding, kind
from rbxcompose.domains.vision.calibration import CameraFileError, read_calibration
from rbxcompose.domains.worlds.optics import LEAST_VIEW, MOST_VIEW
from rbxcompose.domains.worlds.sections.world import world
from rbxcompose.manifest.fields import FileName
from rbxcompose.manifest.files import resolve
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, WantedComponent, Wiring
from rbxcompose.manifest.tree import KeyPath, at

CAMERA = "camera"
NO_CALIBRATION = kind("RBX3721")
Side = Annotated[int, Field(ge=16, le=8192)]


class CameraModel(Config):
    """Where a camera is, and what its pictures are like."""

    frame: str
    """The link that looks along its x, or along its z if the name ends in `optical_frame`."""
    size: tuple[Side, Side] = (640, 480)
    """Width and height of its pictures in pixels; of a simulated one, 2048 at most."""
    rate: Frequency = Field(15.0, gt=0, le=100)
    """Pictures a second."""
    calibration: FileName | None = None
    """Its calibration, by `rbxcompose camera calibrate`; a simulated camera has the same lens."""
    device: str = "/dev/video0"
    """The real camera, better one of `/dev/v4l/by-id`."""
    exposure: Time = Field(0.0, ge=0, le=1)
    """For how long the real one exposes a picture; 0 leaves that to it."""
    view: Angle = Field(math.radians(60), gt=LEAST_VIEW, lt=MOST_VIEW)
    """Of the simulated one without a calibration: from its left to its right edge."""
    depth: bool = False
    """Whether the simulated one measures depth."""
    noise: Length = Field(0.0, ge=0, le=1)
    """Standard deviation of its depths at 1 m."""


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    for name, model in contents.of(cameras).items():
        config: dict[str, object] = {"frame": model.frame, "rate": model.rate}
        if contents.is_simulated and contents.of(world) is not None:
            config |= {"size": model.size, "topic": name, "depth": model.depth, "noise": model.noise}
            config["view"] = f"{model.view!r} rad"
            places = dict[str, KeyPath]()
            if model.calibration is not None:
                known = read_calibration(Path(model.calibration))
                config["pinhole"] = [known.fx, known.fy, known.cx, known.cy]
                config["distortion"] = list(known.distortion)
                places = dict.fromkeys(("pinhole", "distortion"), ("cameras", name, "calibration"))
            yield WantedComponent(name, "camera_sim", config, ("cameras", name), places=places)
            continue
        width, height = model.size
        config |= {"width": width, "height": height, "device": model.device, "exposure": model.exposure}
        config |= {"topic": f"{name}/image_raw", "info": f"{name}/camera_info", "calibration": model.calibration or ""}
        yield WantedComponent(name, "usb_camera", config, ("cameras", name))


@section("cameras", CameraModel, order=64, names=CAMERA, runs=True, wires=True, entry="camera", components=_components)
def cameras(reading: Reading[CameraModel]) -> dict[str, CameraModel]:
    """Cameras by name, simulated in a `world` or real; pictures are at `NAME/image_raw`.

    Example:
        cameras:
          front: {frame: base_footprint, size: [640, 480], view: 70 deg}
    """
    found = dict[str, CameraModel]()
    for name, model in reading.readable_entries().items():
        if model.calibration is not None:
            where = reading.value("cameras", name, "calibration")
            node = reading.node
            writer = reading.writer(at(node, (name, "calibration")) or node) if node is not None else Path()
            named = resolve(model.calibration, writer, where)
            if not isinstance(named, Finding) and (why := _unlike(named, model.size)):
                named = NO_CALIBRATION.at(where, f"'{model.calibration}' is no calibration of it: {why}")
            if isinstance(named, Finding):
                reading.report.add(named)
            model = model.model_copy(update={"calibration": None if isinstance(named, Finding) else str(named)})
        found[name] = model
    return found


def _unlike(file: Path, size: tuple[int, int]) -> str:
    """Return why a file is no calibration of a camera with pictures of a size, or nothing."""
    try:
        known = read_calibration(file)
    except CameraFileError as error:
        return str(error)
    if (known.width, known.height) != size:
        return f"it is of {known.width} x {known.height} pixels, and its pictures have {size[0]} x {size[1]}"
    return ""
