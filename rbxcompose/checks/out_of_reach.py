"""A position of a joint that its servos do not reach."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity, Span
from rbxcompose.manifest.tree import at
from rbxcompose.model.driven_joints import DrivenJoint, driven_joints
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING

_SCALES = ("calibration", "travel", "ratio", "offset")
_TURNS = 4 * math.tau  # [rad] of a limit that no joint with a servo has
_TICK = 1.01  # ticks that a limit may lie outside: that of 150 deg is one beyond the last tick of an AX-12


@check("RBX2225", Severity.WARNING, closed=(WIRING,))
def out_of_reach(robot: Robot) -> Iterator[Finding]:
    """A joint may go where its servo cannot."""
    for one in driven_joints(robot):
        if one.joint.mode == "position":
            yield from _told(one)


def _told(one: DrivenJoint) -> Iterator[Finding]:
    joint, limits = one.joint, one.joint.limits
    (first, last), slack = joint.reach, _TICK * joint.per_tick
    is_below = limits.least < first - slack and (limits.lower is not None or joint.is_continuous)
    is_above = limits.greatest > last + slack and (limits.upper is not None or joint.is_continuous)
    if not (is_below or is_above):
        return
    is_free = limits.lower is None and limits.upper is None
    bounds = f"{one.position(limits.least)} to {one.position(limits.greatest)}"
    wanted = "turns without end" if is_free else f"may go from {bounds}"
    servo = "its servo reaches" if len(joint.servos) == 1 else "its servos reach"
    body = one.body.limits if one.body else None
    message = f"'{one.name}' {wanted}, but {servo} {one.position(first)} to {one.position(last)}"
    if body and not one.slides and body.may_be_degrees:
        return  # told as RBX2021
    if body and not is_free and (meant := _in_degrees(one)):
        yield out_of_reach.at(body.span, message, help=f"limits in a URDF are in radians: for degrees, write {meant}")
        return
    yield out_of_reach.at(
        _place(one, is_shifted=limits.least > last or limits.greatest < first),
        message,
        help=_remedy(one, max(first, limits.least), min(last, limits.greatest)),
        related=[Related(body.span, "its limits in the body")] if body else [],
    )


def _in_degrees(one: DrivenJoint) -> str:
    """Return what to write if the limits in the body are no angles in radians, but may be some in degrees."""
    body = one.body.limits if one.body else None
    own = at(one.robot.manifest.root, ("joints", one.name, "limits", "position"))
    if one.slides or own is not None or body is None or max(abs(body.lower or 0.0), abs(body.upper or 0.0)) < _TURNS:
        return ""
    lower, upper = (math.radians(limit or 0.0) for limit in (body.lower, body.upper))
    return f'\'lower="{lower:.4g}" upper="{upper:.4g}"\''


def _place(one: DrivenJoint, *, is_shifted: bool) -> Span:
    """Return where the range is written, else what shifts or scales it; if it `is_shifted` whole, what shifts it."""
    own = (("joints", one.name, *path) for path in (("limits", "position"), *((key,) for key in _SCALES)))
    neutral = (("actuators", name, "neutral") for name in one.written.servos)
    every = (*neutral, *own) if is_shifted else (*own, *neutral)
    paths = [path for path in every if at(one.robot.manifest.root, path) is not None]
    return one.robot.key(*paths[0]) if paths else one.key()


def _remedy(one: DrivenJoint, least: float, greatest: float) -> str:
    if least >= greatest:
        return _beyond_the_ticks(one) or "check 'neutral', 'offset' and 'invert': no position is within both"
    unit, per = ("mm", 0.001) if one.slides else ("deg", math.pi / 180)
    lower, upper = math.ceil(least / per - 1e-6), math.floor(greatest / per + 1e-6)
    return f"limit it: 'position: [{lower} {unit}, {upper} {unit}]' below its 'limits'"


def _beyond_the_ticks(one: DrivenJoint) -> str:
    for servo in one.joint.servos:
        first, last = servo.ends
        if not first <= servo.neutral <= last:
            middle = f"the middle, 'neutral: {servo.model.family.centre}', is the default"
            return f"the ticks of servo {servo.id}, {servo.model.name}, go from {first} to {last}: {middle}"
    return ""
