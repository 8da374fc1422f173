"""Bases on two wheels and the body that carries them: where each wheel is, and how it turns."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Vector3, rotate
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.domains.body.model import Body, BodyJoint
from rbxcompose.domains.body.sections.body import body
from rbxcompose.sdk.capabilities import RollsOn, Setting

TOLERANCE = 0.02  # of a length, within which two count as the same


@dataclass(frozen=True, slots=True)
class BodyWheel:
    """A wheel of the body: its middle [m] and its axis in the frame of the base, and its radius [m], if it has one."""

    joint: BodyJoint
    setting: Setting[str]
    centre: Vector3
    axis: Vector3
    radius: float | None


@dataclass(frozen=True, slots=True)
class RollingBase:
    """A base, and its wheels as the body has them."""

    component: RobotComponent
    rolls: RollsOn
    left: BodyWheel
    right: BodyWheel

    @property
    def wheels(self) -> tuple[BodyWheel, BodyWheel]:
        """Return both."""
        return self.left, self.right

    @property
    def wheel_distance(self) -> float:
        """Return how far the wheels are apart [m], to the left."""
        return self.left.centre[1] - self.right.centre[1]

    @property
    def has_other_radius(self) -> bool:
        """Return whether its wheels have another radius than those of the body."""
        radius = self.left.radius
        return self.rolls.wheel_radius is not None and radius is not None and differs(self.rolls.wheel_radius, radius)


def differs(setting: Setting[float], length: float) -> bool:
    """Return whether a length is another one than that of the body."""
    return abs(setting.value - length) > TOLERANCE * max(setting.value, length)


def rolling_bases(robot: Robot) -> Iterator[RollingBase]:
    """Yield the bases whose wheels are joints of the body."""
    description = robot.manifest.contents.of(body)
    shape = description.body if description else Body("")
    for component, rolls in robot.declared(RollsOn):
        link = rolls.link.value if rolls.link else ""
        found = [_wheel(shape, setting, link) for setting in (rolls.left, rolls.right) if setting.value in shape.joints]
        if len(found) == len((rolls.left, rolls.right)):
            yield RollingBase(component, rolls, *found)


def _wheel(body: Body, setting: Setting[str], link: str) -> BodyWheel:
    joint, poses = body.joints[setting.value], body.poses({})
    there = poses[joint.child] if link not in poses else poses[link].inverse().compose(poses[joint.child])
    child = body.links[joint.child]
    round_ones = [
        collision
        for collision in (*child.collisions, *child.visuals)
        if collision.geometry.kind in ("cylinder", "sphere")
    ]
    shape = next(iter(round_ones), None)
    centre = there.apply(shape.origin.translation) if shape else there.translation
    radius = shape.geometry.size[0] if shape else None
    return BodyWheel(joint, setting, centre, rotate(there.rotation, joint.axis), radius)
