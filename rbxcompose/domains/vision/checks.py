"""Rules about tags and cameras."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rbxcompose.base.findings import Finding, Severity
from rbxcompose.base.units import LENGTH, TIME, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.sdk import CommandsMotion
from rbxcompose.sdk.ports import In, Out

DETECTOR, SIMULATED, REAL = "tag_detector", "camera_sim", "usb_camera"
LARGEST, SMALLEST = 1.0, 0.005  # [m] of a tag that is probably meant
SEEN = 20.0  # [px] of a black square that is found in 19 of 20 pictures, measured with 36h11
BLURRED = 2.0  # [px] by which a picture may be blurred
USUAL = math.radians(60)  # view of a camera of which it is not known


@check("RBX3740", Severity.WARNING, closed=())
def tag_of_strange_size(robot: Robot) -> Iterator[Finding]:
    """A tag is larger than 1 m or smaller than 5 mm: probably another unit was meant."""
    for made in robot.components.values():
        if made.type_name != DETECTOR:
            continue
        config: Any = made.config
        sizes = {f"sizes.{name}": size for name, size in config.sizes.items()}
        for key, size in {"size": config.size, **sizes}.items():
            if size is not None and not SMALLEST <= size <= LARGEST:
                meant = size / 100 if size > LARGEST else size * 10
                help_text = f"did you mean {format_quantity(meant, LENGTH)}?"
                message = f"a tag of {format_quantity(size, LENGTH)} is unusual"
                yield tag_of_strange_size.at(robot.value(*made.place(key)), message, help=help_text)


@check("RBX3741", Severity.WARNING, closed=())
def tag_too_small(robot: Robot) -> Iterator[Finding]:
    """A tag is too small to be found at the distance at which something follows it, or docks at it."""
    for made in robot.components.values():
        if made.type_name not in ("tag_follower", "tag_docking"):
            continue
        detector = _source(robot, made, "tags")
        camera = _source(robot, detector, "image") if detector is not None and detector.type_name == DETECTOR else None
        if detector is None or camera is None or (focal := _focal_length(camera)) is None:
            continue
        config: Any = made.config
        known: Any = detector.config
        far = config.distance + (config.room if made.type_name == "tag_docking" else 0.0)
        size = known.sizes.get(getattr(config, "tag", ""), known.size)
        if size is not None and size * focal < SEEN * far:
            message = (
                f"a tag of {format_quantity(size, LENGTH)} is {size * focal / far:.0f} pixels wide for '{camera.name}' "
                f"at {format_quantity(round(far, 3), LENGTH)}, and is found from {SEEN:.0f} pixels on"
            )
            help_text = f"it is seen up to {format_quantity(round(size * focal / SEEN, 2), LENGTH)}: take a larger tag"
            yield tag_too_small.at(robot.value(*made.place("distance")), message, help=help_text)


@check("RBX3742", Severity.WARNING, closed=())
def exposure_too_long(robot: Robot) -> Iterator[Finding]:
    """A camera exposes its pictures for so long that they are blurred while the robot turns."""
    rates = [
        able.max_turn_rate.value
        for made in robot.components.values()
        for able in made.declared(CommandsMotion)
        if able.max_turn_rate is not None
    ]
    for made in robot.components.values():
        config: Any = made.config
        if made.type_name != REAL or not config.exposure or not rates:
            continue
        focal = _focal_length(made) or config.width / 2 / math.tan(USUAL / 2)
        blur = max(rates) * focal * config.exposure
        if blur > BLURRED:
            longest = format_quantity(float(f"{BLURRED / max(rates) / focal:.2g}"), TIME)
            turning = f"{math.degrees(max(rates)):.0f} deg/s"
            message = f"at {turning}, pictures are blurred by {blur:.0f} pixels in {config.exposure * 1e3:g} ms"
            help_text = f"expose them for {longest} at most, with more light, or turn more slowly"
            yield exposure_too_long.at(robot.value(*made.place("exposure")), message, help=help_text)


def _source(robot: Robot, made: RobotComponent, port: str) -> RobotComponent | None:
    """Return the component that publishes what another one reads at a port."""
    topics = {end.topic for end in made.ends if end.name == port and isinstance(end.port, In)}
    for other in robot.components.values():
        if any(isinstance(end.port, Out) and end.topic in topics for end in other.ends):
            return other
    return None


def _focal_length(camera: RobotComponent) -> float | None:
    """Return the focal length of a camera [px], None if that is not known."""
    config: Any = camera.config
    if camera.type_name == SIMULATED:
        return float(config.intrinsics.fx)
    if camera.type_name == REAL and config.calibration:
        from rbxcompose.domains.vision.camera_file import CameraFile, CameraFileError  # imports numpy

        try:
            return CameraFile.read(Path(config.calibration)).fx
        except CameraFileError:
            return None
    return None
