"""Things that are wider than a gripper opens."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.body.model import Body
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.arm_goals import word_of, written_reaches
from rbxcompose.model.robot import Robot
from rbxcompose.motion.grasps import grasps_of, least_width, solid_of
from rbxcompose.motion.scene import PlacedObject
from rbxcompose.rules import WIRING
from rbxcompose.sections.arms import hand_in
from rbxcompose.sections.scene import scene
from rbxcompose.units import LENGTH, format_quantity

_BEARINGS = 16  # directions from which an arm may come


@check("RBX2381", Severity.WARNING, closed=(WIRING, "scene"))
def too_wide(robot: Robot) -> Iterator[Finding]:
    """A gripper is to pick what is wider than it opens."""
    contents, description = robot.manifest.contents, robot.manifest.body
    if description is None:
        return
    things = {one.name: one for one in contents.of(scene).objects}
    for pick in written_reaches(robot, "pick"):
        name, span = word_of(pick, "object")
        one, hand = things.get(name), hand_in(contents, pick.arm)
        if one is None or hand is None or hand.opening is None or pick.may_fail:
            continue
        width, widest = _width(description.body, one, [each.width for each in hand.grasps.get(name, ())], hand.opening)
        if width is not None:
            shown, most = (format_quantity(round(each, 4), LENGTH, "cm") for each in (width, widest))
            yield too_wide.at(
                span,
                f"'{name}' is {shown} wide where fingers hold it, and the gripper of '{pick.name}' opens {most}",
                help="choose a thinner thing or a wider gripper; is a unit or a radius wrong?",
                related=[Related(robot.key("scene", "objects", name), "the thing")],
            )


def _width(
    body: Body, one: PlacedObject, given: list[float], opening: tuple[float, float]
) -> tuple[float | None, float]:
    """Return the width of a thing where it can be held [m], None if it fits or is unknown, and the opening [m]."""
    widest = opening[1]
    if given:
        return (min(given) if min(given) >= widest else None), widest
    if (solid := solid_of(one)) is None:
        return None, widest
    if least_width(solid.shape) >= widest:
        return least_width(solid.shape), widest
    if one.link != body.root:
        return None, widest  # nobody knows how it will be turned
    at = one.pose.compose(solid.pose)

    def held(limit: float) -> list[float]:
        turns = (math.tau * index / _BEARINGS for index in range(_BEARINGS))
        return [grasp.width for turn in turns for grasp in grasps_of(solid.shape, at, turn, limit)]

    return (None if held(widest) else min(held(math.inf), default=None)), widest
