"""Rules about tags and cameras."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from rbxcompose.base.findings import WIRING, Finding, Severity, Span
from rbxcompose.base.units import LENGTH, TIME, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.domains.vision.calibration import CameraFileError, read_calibration
from rbxcompose.domains.worlds.tag_pictures import FAMILIES
from rbxcompose.manifest.tree import ScalarNode, at
from rbxcompose.manifest.validate import NOT_A_CHOICE
from rbxcompose.sdk import CommandsMotion
from rbxcompose.sdk.ports import In, Out

DETECTOR, SIMULATED, REAL = "tag_detector", "camera_sim", "usb_camera"
FINDS_BY_NETWORK = "detector"
FOR_BASES = ("tag_follower", "tag_docking")
USERS = {
    "tag_follower": ("tags", "tag"),
    "tag_docking": ("tags", ""),
    "tagged_people": ("tags", "tags"),
    "tag_localisation": ("tags", "tags"),
    "tags_cog": ("seen", "tags"),
}
"""Types that use tags: the port where they learn of them, and the field that names some."""
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


@check(NOT_A_CHOICE, closed=(WIRING,))
def unknown_tag(robot: Robot) -> Iterator[Finding]:
    """A component or a mission names a tag that the camera's detector does not know."""
    for made in robot.components.values():
        if (detector := _detector(robot, made)) is None:
            continue
        known: Any = detector.config
        names = [*known.names, *known.boards]
        numbers = set(map(str, range(FAMILIES[known.family].total)))
        for word, span in (*_tags_of(robot, made), *_tags_in_missions(robot, made)):
            if word not in names and word not in numbers:
                yield NOT_A_CHOICE.misspelt(span, f"'{detector.name}' knows no tag '{word}'", word, names, "its tags")


@check("RBX3741", Severity.WARNING, closed=())
def tag_too_small(robot: Robot) -> Iterator[Finding]:
    """A tag is too small to be found at the distance at which something follows it or docks at it, or has no size."""
    for made in robot.components.values():
        if (detector := _detector(robot, made)) is None:
            continue
        config: Any = made.config
        known: Any = detector.config
        if known.size is None and not known.sizes:
            message = f"the tags of '{detector.name}' have no size, so '{made.name}' does not learn where they are"
            help_text = "add 'size: ...', the side of the black square of a tag"
            yield tag_too_small.at(robot.key(*detector.path), message, help=help_text)
            continue
        camera = _source(robot, detector, "image")
        if made.type_name not in FOR_BASES or camera is None or (focal := _focal_length(camera)) is None:
            continue
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


@check("RBX3743", closed=())
def unusable_network(robot: Robot) -> Iterator[Finding]:
    """The network of a detector is not there, or is none for pictures."""
    for made in robot.components.values():
        if made.type_name != FINDS_BY_NETWORK or not made.is_sound:
            continue
        config: Any = made.config
        path, place = Path(config.model), made.place("model")
        node = at(robot.manifest.root, place)
        written = node.text if isinstance(node, ScalarNode) else ""
        is_there = path.exists()
        if is_there or not written.startswith("/"):  # a whole path is one on the computer of the robot
            why = _trouble_with(path, path.stat().st_mtime_ns if is_there else 0)
            if why:
                yield unusable_network.at(robot.value(*place), why.replace(str(path), written))


@lru_cache(maxsize=8)
def _trouble_with(path: Path, changed: int) -> str:
    """Return why a file that has changed last at a time [ns] is no network for pictures, or nothing."""
    from rbxcompose.domains.vision.components.detector import Network, NetworkError  # few robots have one

    if path.is_file() and find_spec("onnxruntime") is None:
        return ""
    try:
        Network(path)
    except NetworkError as error:
        return str(error)
    return ""


def _detector(robot: Robot, made: RobotComponent) -> RobotComponent | None:
    """Return the detector whose tags a component uses; None if it uses none, or those of something else."""
    found = _source(robot, made, USERS[made.type_name][0]) if made.type_name in USERS and made.is_sound else None
    return found if found is not None and found.type_name == DETECTOR else None


def _tags_of(robot: Robot, made: RobotComponent) -> Iterator[tuple[str, Span]]:
    """Yield the tags that the configuration of a component names, with their places."""
    field = USERS[made.type_name][1]
    named: str | list[str] | dict[str, Any] = getattr(made.config, field, "")
    place = made.place(field)
    if isinstance(named, dict):
        yield from ((name, robot.key(*place, name)) for name in named)
    elif isinstance(named, list):
        yield from ((name, robot.value(*place, index)) for index, name in enumerate(named))
    elif named:
        yield named, robot.value(*place)


def _tags_in_missions(robot: Robot, made: RobotComponent) -> Iterator[tuple[str, Span]]:
    """Yield the tags that missions name in goals of a component, with their places."""
    topics = {end.topic for end in made.ends}
    for node in (node for mission in robot.missions.values() for node in mission.program.nodes):
        if (source := robot.skills.get(node.skill)) is None or source.topic not in topics:
            continue
        for argument in node.step.arguments:
            written, name = argument.value, argument.name or source.skill.main
            if name == "tag" and isinstance(written, ScalarNode) and re.fullmatch(r"\w+", written.text):
                yield written.text, written.span


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
        try:
            return read_calibration(Path(config.calibration)).fx
        except CameraFileError:
            return None
    return None
