"""Poses in missions that an arm cannot reach."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.body.model import Body
from rbxcompose.check_runner import check
from rbxcompose.checks.goal_beyond_limits import known_value
from rbxcompose.findings import Finding, Severity, suggest
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.model.arm_goals import WrittenReach, first_joint_in, length_of, word_of, written_reaches
from rbxcompose.model.charge import constants
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.units import LENGTH, format_quantity

_FEW = 3  # joints that a position alone needs
_TIMES = 10.0  # as far as the arm is long: a unit is wrong
_AXES = ("x", "y", "z")
_TURNS = ("roll", "pitch", "yaw")


@check("RBX4167", Severity.WARNING, closed=(WIRING,))
def reach_goal(robot: Robot) -> Iterator[Finding]:
    """An arm is to reach what it cannot reach."""
    description = robot.manifest.body
    for reach in written_reaches(robot) if description else ():
        if description:
            yield from _mistakes(robot, description.body, reach)


def _mistakes(robot: Robot, body: Body, reach: WrittenReach) -> Iterator[Finding]:
    frame, written = body.root, reach.arguments.get("frame")
    if written is not None and (not isinstance(written.value, ScalarNode) or "$" in written.value.text):
        return
    if written is not None and isinstance(written.value, ScalarNode):
        frame = written.value.text or body.root
    if written is not None and frame not in body.links:
        message = f"the body has no link '{frame}' in whose frame '{reach.node.skill}' could count"
        yield reach_goal.at(written.value.span, message, help=suggest(frame, body.links, "its links"))
    elif not reach.may_fail:
        yield from filter(None, (_too_stiff(reach), _too_far(robot, body, reach, frame)))


def _too_far(robot: Robot, body: Body, reach: WrittenReach, frame: str) -> Finding | None:
    if any(one in reach.arguments and word_of(reach, one)[0] != "false" for one in ("any_position", "approximate")):
        return None
    known, shoulder = constants(reach.mission), first_joint_in(body, reach.arm, frame)
    at = [known_value(reach.arguments[axis], known) if axis in reach.arguments else 0.0 for axis in _AXES]
    x, y, z, slack = (*at, known_value(reach.arguments["tolerance"], known) if "tolerance" in reach.arguments else 0.0)
    if shoulder is None or x is None or y is None or z is None or slack is None:
        return None
    away, length = math.dist((x, y, z), shoulder), length_of(robot, body, reach.arm)
    if away <= length + slack + 0.001:
        return None
    far = {axis: abs(value) for axis, value in zip(_AXES, (x, y, z), strict=True) if axis in reach.arguments}
    span = reach.arguments[max(far, key=lambda axis: far[axis])].value.span if far else reach.node.span
    shown, most = (format_quantity(round(one, 3), LENGTH, "m" if one >= 1.0 else "cm") for one in (away, length))
    is_unit = away > _TIMES * length
    return reach_goal.at(
        span,
        f"this is {shown} from the first joint of '{reach.name}', and all its links together are {most} long",
        help="is a unit wrong? A number without a unit counts in metres" if is_unit else "choose a place nearer to it",
    )


def _too_stiff(reach: WrittenReach) -> Finding | None:
    asked = reach.arguments.keys() & {*_TURNS, "any_orientation", "any_position", "approximate", "angle_tolerance"}
    count = len(reach.arm.group.joints)
    if count > _FEW or asked:
        return None
    return reach_goal.at(
        reach.node.span,
        f"'{reach.name}' has {count} joints: it cannot turn its tip as it likes, and no orientation is asked for",
        help="add 'any_orientation: true', so that only the position counts",
    )
