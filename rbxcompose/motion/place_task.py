"""Puts down what an arm holds: go above the place, straight down, open, detach, straight back."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import product

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3, Vector3, conjugate, multiply, quaternion_from_yaw, rotate, yaw_of
from rbxcompose.motion.arm_goal import ArmGoal
from rbxcompose.motion.collisions import Checker
from rbxcompose.motion.contacts import Contact
from rbxcompose.motion.grasps import reach_of
from rbxcompose.motion.hand_task import Hand, HandSite, HandTask, HandWorks, Work, distance
from rbxcompose.motion.reasons import GraspReason, MotionReason, StageFailure
from rbxcompose.motion.scene import PlacedObject

WAY = 0.08  # [m] of the lines down to a place and back from it, unless the goal says otherwise
TURNS = (0.0, 0.3, -0.3, 0.6, -0.6, 0.9, -0.9)  # [rad] of the hand, from the direction in which the place is
AROUND = 6  # further points at the distance of the tolerance: 49 poses with 7 turns
ABOVE = 1e-3  # [m] between an object and what it is put on: servos are not exact
RELEASE = 0.02  # [m] by which the gripper opens farther than the object is wide
STEEP = 0.9  # sine of the angle from which a hand points down, so that it has no direction seen from above
UP: Vector3 = (0.0, 0.0, 1.0)
DOWN: Vector3 = (0.0, 0.0, -1.0)


@dataclass(frozen=True, slots=True)
class PlaceGoal:
    """Where the object is to be put; lengths in [m], of the last two 0 is the usual one."""

    at: Vector3
    """The middle of the object in `frame`, or from the middle of the upper face of `on`."""
    frame: str = ""
    on: str = ""
    tolerance: float = 0.0
    approach: float = 0.0
    retreat: float = 0.0
    unknown: str = ""
    """Why there is no such place, if there is none."""


class PlaceTask(HandTask):
    """Puts an object down, upright as it stood when it was picked; how it is turned about the vertical is free."""

    stages = ("choose", "approach", "lower", "open", "detach", "retreat")

    def __init__(self, site: HandSite, works: HandWorks, hand: Hand, goal: PlaceGoal, pace: ArmGoal) -> None:
        super().__init__(site, works, hand, pace)
        self._goal = goal

    def choose(self) -> Work:
        """Find out what is held, and where it is to be."""
        failure = yield from self.settle()
        if failure is not None:
            return failure
        one, goal = self.held, self._goal
        if goal.unknown:
            return self.fail(MotionReason.UNKNOWN_GOAL, goal.unknown)
        if one is None:
            return self.fail(GraspReason.NOTHING_HELD, "it holds nothing")
        if goal.frame and goal.frame not in self.kinematics.body.links:
            return self.fail(MotionReason.UNKNOWN_GOAL, f"there is no link '{goal.frame}'")
        if goal.on and (self.object_named(goal.on) is None or goal.on == one.name):
            return self.fail(GraspReason.UNKNOWN_OBJECT, f"there is nothing '{goal.on}' to put it on")
        if not all(map(math.isfinite, (*goal.at, goal.tolerance))):
            return self.fail(MotionReason.UNKNOWN_GOAL, "the place is not finite")
        self._one = one
        self._upright = self.site.uprights.get(one.name, (0.0, 0.0, 0.0, 1.0))
        middle = self._place(one)
        if middle is None:
            words = f"how high '{one.name}' and '{goal.on}' are is known of boxes, cylinders and spheres only"
            return self.fail(GraspReason.NO_GRASPS, f"{words}: say where, with x, y and z")
        self._middle = middle
        return None

    def _place(self, one: PlacedObject) -> Vector3 | None:
        """Return where the object is to be in the root's frame; None if it is not known how high it would stand."""
        goal = self._goal
        if goal.on and (base := self.object_named(goal.on)) is not None:
            under = self.in_root(base)
            top, bottom = reach_of(base, under.rotation, UP), reach_of(one, self._upright, DOWN)
            if top is None or bottom is None:
                return None
            top += bottom + ABOVE
            ahead = rotate(quaternion_from_yaw(yaw_of(under.rotation)), (goal.at[0], goal.at[1], goal.at[2] + top))
            x, y, z = (base_at + part for base_at, part in zip(under.translation, ahead, strict=True))
            return (x, y, z)
        frame = self.kinematics.poses(self.here)[goal.frame] if goal.frame else Transform3()
        return frame.apply(goal.at)

    def approach(self) -> Work:
        """Find a pose whose lines are free, and go above it."""
        way = yield from self.reached(self._contacts(), self, ("lower", "retreat"))
        if isinstance(way, StageFailure):
            return way
        self._way = way
        return None

    def lower(self) -> Work:
        """Go straight down until the object stands."""
        contact = self._way.contact
        return self.follow(self._way.coming, lambda: self.coming(contact))

    def open(self) -> Work:
        """Let go."""
        across = rotate(self.hand.grasp.rotation, (0.0, 1.0, 0.0))
        back = rotate(self.hand.grasp.rotation, (0.0, -1.0, 0.0))
        sides = (reach_of(self._one, self._one.pose.rotation, one) for one in (across, back))
        known = [one for one in sides if one is not None]
        return self.opened(sum(known) + RELEASE if known else self.hand.greatest)

    def detach(self) -> Work:
        """Let the object stay where it is."""
        name = self._one.name
        return self.changed(lambda ended: self.site.detach(name, ended), lambda: self.held is None)

    def retreat(self) -> Work:
        """Go straight back; fingers may touch the object."""
        return self.follow(self._way.leaving, self._leaving)

    # Who examines the lines

    def coming(self, contact: Contact) -> Checker:
        """Return the checker of the line down, with the object in the hand."""
        held = self.held or self._one
        return self.tolerant_near(held, self.supports(held, contact.at.compose(held.pose)), contact.at)

    def leaving(self, contact: Contact) -> Checker:
        """Return the checker of the line back, with the object where it was put."""
        return self._standing(contact.at.compose(self._one.pose))

    def _leaving(self) -> Checker:
        one = self.object_named(self._one.name)
        return self._standing(self.in_root(one)) if one is not None else self.works.checker(self.site.objects or ())

    def _standing(self, at: Transform3) -> Checker:
        stands = replace(self._one, link=self.kinematics.body.root, pose=at, touches=self.hand.links)
        return self.works.checker([*self.without(stands.name), stands])

    def _contacts(self) -> Iterator[Contact]:
        """Yield poses of the tip in which the object stands at its place, the very point first."""
        x, y, z = self._middle
        radius = max(0.0, self._goal.tolerance)
        angles = [math.tau * index / AROUND for index in range(AROUND)] if radius else []
        points = [(x, y, z), *((x + radius * math.cos(one), y + radius * math.sin(one), z) for one in angles)]
        back = self._one.pose.inverse()
        for point, turn in product(points, TURNS):
            turned = multiply(quaternion_from_yaw(self._yaw(point) + turn), self._upright)
            tip = Transform3(point, turned).compose(back)
            ahead = rotate(multiply(tip.rotation, self.hand.grasp.rotation), (1.0, 0.0, 0.0))
            way, up = distance(self._goal.retreat, WAY), distance(self._goal.approach, WAY)
            leave_x, leave_y, leave_z = (-way * part for part in ahead)
            yield Contact(tip, (0.0, 0.0, up), (leave_x, leave_y, leave_z))

    def _yaw(self, point: Vector3) -> float:
        """Return by how much to turn the object so that the hand points from the arm to a place; 0 if it hangs."""
        base = self.kinematics.poses(self.here)[self.kinematics.group.base].translation
        tip_of_object = multiply(self._upright, conjugate(self._one.pose.rotation))
        ahead = rotate(multiply(tip_of_object, self.hand.grasp.rotation), (1.0, 0.0, 0.0))
        if abs(ahead[2]) > STEEP:
            return 0.0
        return math.atan2(point[1] - base[1], point[0] - base[0]) - math.atan2(ahead[1], ahead[0])
