"""A joint that cannot be parked where it is told to."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.driven_joints import ROUNDED, DrivenJoint, driven_joints
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.sections.joints import joints
from rbxcompose.sections.safety import safety
from rbxcompose.units import ANGLE, LENGTH, Quantity


@check("RBX2228", closed=(WIRING,))
def parked_joint(robot: Robot) -> Iterator[Finding]:
    """A joint cannot be parked there."""
    driven = {one.name: one for one in driven_joints(robot)}
    for name, position in robot.manifest.contents.of(safety).park.items():
        key = robot.key("safety", "park", name)
        if name not in driven:
            if name not in robot.manifest.contents.of(joints):
                message = f"'{name}' cannot be parked: no servo drives it"
                yield parked_joint.misspelt(key, message, name, driven, "joints with a servo")
        elif told := _mistake(driven[name], position):
            message, help_text = told
            yield parked_joint.at(robot.value("safety", "park", name), message, help=help_text)


def _mistake(one: DrivenJoint, position: Quantity) -> tuple[str, str] | None:
    """Return why it cannot be there, and what helps."""
    limits = one.joint.limits
    if position.dimension != (LENGTH if one.slides else ANGLE):
        needed, word = (LENGTH, "slides") if one.slides else (ANGLE, "turns")
        return f"'{one.name}' {word}, and this is {position.dimension.phrase}", f"write {needed.phrase}"
    if one.joint.mode != "position":
        return f"'{one.name}' cannot be parked: its servo takes velocities", "leave it out"
    if one.mimics:
        return f"'{one.name}' cannot be parked: it follows '{one.mimics}'", f"park '{one.mimics}'"
    nearest = limits.clamped(position.value)
    if abs(position.value - nearest) <= ROUNDED * abs(nearest):
        return None
    bounds = f"{one.position(limits.least)} to {one.position(limits.greatest)}"
    message = f"'{one.name}' is to be parked at {one.position(position.value)}, and goes from {bounds}"
    return message, f"the nearest that it reaches is {one.position(nearest)}"
