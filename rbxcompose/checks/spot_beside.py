"""Spots for things beside what they are to stand on."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from rbxcompose.check_runner import check
from rbxcompose.checks.goal_beyond_limits import known_value
from rbxcompose.findings import Finding, Related, Severity, Span
from rbxcompose.geometry import conjugate, rotate
from rbxcompose.model.arm_goals import word_of, written_reaches
from rbxcompose.model.charge import constants
from rbxcompose.model.robot import Robot
from rbxcompose.motion.grasps import solid_of
from rbxcompose.motion.scene import PlacedObject
from rbxcompose.rules import WIRING
from rbxcompose.sections.arms import arms
from rbxcompose.sections.scene import scene
from rbxcompose.units import LENGTH, format_quantity

_UPRIGHT = 0.999  # cosine of the angle by which a support may be tilted
_ROUNDING = 1e-6  # [m]


@check("RBX2380", Severity.WARNING, closed=(WIRING, "scene"))
def spot_beside(robot: Robot) -> Iterator[Finding]:
    """A spot is beside what the thing is to be put on."""
    contents = robot.manifest.contents
    things = {one.name: one for one in contents.of(scene).objects}
    for arm, one in contents.of(arms).items():
        for name, spot in one.model.spots.items():
            if spot.on in things:
                spans = {axis: robot.value("arms", arm, "spots", name, axis) for axis in ("x", "y")}
                yield from _told(robot, f"the spot '{name}'", things[spot.on], (spot.x, spot.y), spans)
    for place in written_reaches(robot, "place"):
        on, _ = word_of(place, "on")
        given = {axis: place.arguments[axis] for axis in ("x", "y") if axis in place.arguments}
        numbers = {axis: known_value(written, constants(place.mission)) for axis, written in given.items()}
        x, y = numbers.get("x", 0.0), numbers.get("y", 0.0)
        if on in things and x is not None and y is not None and not place.may_fail:
            spans = {axis: written.value.span for axis, written in given.items()}
            yield from _told(robot, "this", things[on], (x, y), spans)


def _told(
    robot: Robot, what: str, on: PlacedObject, at: tuple[float, float], spans: Mapping[str, Span]
) -> Iterator[Finding]:
    for axis, away, edge in _beyond(on, *at):
        shown, most = (format_quantity(round(each, 4), LENGTH, "cm") for each in (abs(away), edge))
        yield spot_beside.at(
            spans[axis],
            f"{what} is {shown} from the middle of '{on.name}', whose edge is {most} from it",
            help=f"choose a place on it: at most {most} from its middle",
            related=[Related(robot.key("scene", "objects", on.name), "it is put on this")],
        )
        return


def _beyond(on: PlacedObject, x: float, y: float) -> Iterator[tuple[str, float, float]]:
    """Yield where a point of the upper face is beyond its edge: the axis, and how far it and the edge are out [m]."""
    solid = solid_of(on)
    turn = on.pose.compose(solid.pose).rotation if solid else (0.0, 0.0, 0.0, 1.0)
    if solid is None or math.hypot(*solid.pose.translation) > _ROUNDING or rotate(turn, (0.0, 0.0, 1.0))[2] < _UPRIGHT:
        return  # its upper face is another one
    if solid.shape.kind == "box":
        own = rotate(conjugate(solid.pose.rotation), (x, y, 0.0))
        for axis, at, size in zip(("x", "y"), own, solid.shape.size, strict=False):
            if abs(at) > size / 2 + _ROUNDING:
                yield axis, at, size / 2
    elif solid.shape.kind == "cylinder" and math.hypot(x, y) > solid.shape.size[0] + _ROUNDING:
        yield "x" if abs(x) >= abs(y) else "y", math.hypot(x, y), solid.shape.size[0]
