"""Picks an object up: open, go before it, straight to it, close, attach, straight up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import rotate
from rbxcompose.motion.arm_goal import ArmGoal
from rbxcompose.motion.collisions import Checker
from rbxcompose.motion.contacts import Contact
from rbxcompose.motion.grasps import Grasp, grasps_of, least_width, solid_of
from rbxcompose.motion.hand_task import SLACK, Hand, HandSite, HandTask, HandWorks, Work, distance
from rbxcompose.motion.reasons import GraspReason, StageFailure

WAY = 0.08  # [m] of the lines to an object and up from it, unless the goal says otherwise
MOVED, TURNED = 0.01, 0.1  # [m], [rad] by which an object has moved if it is approached again
AGAIN = 3  # times that it is
CLEARANCE = 0.03  # [m] by which the gripper is open farther than the object is wide


@dataclass(frozen=True, slots=True)
class PickGoal:
    """What is to be picked; a length of 0 is the usual one [m]."""

    object: str
    approach: float = 0.0
    lift: float = 0.0
    opening: float = 0.0
    squeeze: float = 0.0
    grasps: Sequence[Grasp] = ()
    """Poses in the frame of the object; without any they follow from its shape."""


class PickTask(HandTask):
    """Picks an object up; one that the arm holds already is picked, so that the goal may be sent again after a stop."""

    stages = ("choose", "open", "approach", "grasp", "close", "attach", "lift")

    def __init__(self, site: HandSite, works: HandWorks, hand: Hand, goal: PickGoal, pace: ArmGoal) -> None:
        super().__init__(site, works, hand, pace)
        self._goal = goal
        self._grasps: list[Grasp] = []

    def choose(self) -> Work:
        """Find out how the object may be held."""
        failure = yield from self.settle()
        if failure is not None:
            return failure
        if (held := self.held) is not None:
            if held.name == self._goal.object:
                self.is_done = True
                return None
            return self.fail(GraspReason.ALREADY_HOLDS, f"it holds '{held.name}'")
        one = self.object_named(self._goal.object)
        if one is None:
            there = ", ".join(sorted(each.name for each in self.site.objects or ())) or "none"
            return self.fail(
                GraspReason.UNKNOWN_OBJECT, f"there is no object '{self._goal.object}' in the scene; there: {there}"
            )
        self._one, self._at, widest = one, self.in_root(one), self.hand.greatest
        self._below = self.supports(one, self._at)
        if self._goal.grasps:
            given = sorted(self._goal.grasps, key=lambda each: -each.quality)
            self._grasps = [replace(each, pose=self._at.compose(each.pose)) for each in given if each.width < widest]
            width = min(each.width for each in given)
        elif (solid := solid_of(one)) is not None:
            at, width = self._at.compose(solid.pose), least_width(solid.shape)
            self._grasps = grasps_of(solid.shape, at, self._bearing(), widest)
        else:
            words = f"'{one.name}' is neither a box nor a cylinder nor a sphere"
            return self.fail(GraspReason.NO_GRASPS, f"{words}, and the arm has no 'grasps' for it")
        if not self._grasps:
            words = f"where '{one.name}' is narrowest it is {width * 100:.1f} cm wide"
            return self.fail(GraspReason.TOO_WIDE, f"{words}, and the gripper opens {widest * 100:.1f} cm")
        return None

    def _bearing(self) -> float:
        """Return the direction from the arm to the object, seen from above."""
        base = self.kinematics.poses(self.here)[self.kinematics.group.base].translation
        x, y, _ = self._at.translation
        return math.atan2(y - base[1], x - base[0])

    def open(self) -> Work:
        """Open the gripper wide enough for all grasps, before anything is planned: open fingers need room."""
        widest = max(each.width for each in self._grasps) + CLEARANCE
        self._opening = distance(self._goal.opening, widest)
        return self.opened(self._opening)

    def approach(self) -> Work:
        """Find a grasp whose lines are free, and go to where the first one begins."""
        way = yield from self.reached(map(self._contact, self._grasps), self, ("grasp", "lift"))
        if isinstance(way, StageFailure):
            return None if self._has_moved else way  # the next stage begins again
        self._way = way
        return None

    def grasp(self) -> Work:
        """Go straight to the object, which open fingers do not touch; begin again if it is not where it was."""
        for _ in range(AGAIN + 1):
            failure: StageFailure | None = None
            if not self._has_moved:
                failure = yield from self.follow(self._way.coming, lambda: self.works.checker(self.site.objects or ()))
            if not self._has_moved or self.is_canceled:
                return failure
            self.site.info(f"'{self._one.name}' is elsewhere: it is approached again")
            for stage in self.stages[: self.stages.index("grasp")]:
                self.stage = stage
                self.site.told(stage)
                failure = yield from getattr(self, stage)()
                if failure is not None or self.is_canceled:
                    return failure
            self.stage = "grasp"
        return self.fail(GraspReason.NOTHING_GRASPED, f"'{self._one.name}' does not stay where it is")

    def look_again(self) -> None:
        """Stop also if the object is no longer where a grasp was planned for."""
        if self.stage in ("approach", "grasp") and self._has_moved and self._motion is not None:
            self._motion.cancel()
        else:
            super().look_again()

    @property
    def _has_moved(self) -> bool:
        """Return whether the object is gone, or elsewhere than it was when grasps of it were chosen."""
        one = self.object_named(self._one.name)
        if one is None:
            return True
        now = self.in_root(one)
        turned = abs(sum(part * other for part, other in zip(now.rotation, self._at.rotation, strict=True)))
        away = math.dist(now.translation, self._at.translation)
        return away > MOVED or 2.0 * math.acos(min(1.0, turned)) > TURNED

    def close(self) -> Work:
        """Close the gripper on the object."""
        width = self._way.contact.width
        told = yield from self.gripped(width - max(0.0, self._goal.squeeze))
        if told.problem:
            return self.fail(GraspReason.GRIPPER_FAILED, told.problem)
        if told.opening < width - SLACK:
            words = f"the gripper closed to {told.opening * 1e3:.0f} mm"
            text = f"{words}, and '{self._one.name}' is {width * 1e3:.0f} mm wide"
            yield from self.gripped(self._opening)  # so that the arm can leave
            return self.fail(GraspReason.NOTHING_GRASPED, text)
        return None

    def attach(self) -> Work:
        """Let the object move with the tip."""
        self.place_body()
        name, tip = self._one.name, self.hand.links[0]
        self.site.uprights[name] = self._at.rotation
        return self.changed(lambda ended: self.site.attach(name, tip, ended), lambda: self.held is not None)

    def lift(self) -> Work:
        """Go straight up; near to where it stood, the object may touch what it stands on."""
        return self.follow(
            self._way.leaving, lambda: self.tolerant_near(self.held or self._one, self._below, self._way.contact.at)
        )

    # Who examines the lines

    def coming(self, contact: Contact) -> Checker:
        """Return the checker of the line to the object."""
        return self.works.checker(self.site.objects or ())

    def leaving(self, contact: Contact) -> Checker:
        """Return the checker of the line up, with the object in the hand."""
        held = self.carried(self._one, contact.at.inverse().compose(self._at))
        return self.tolerant_near(held, self._below, contact.at)

    def _contact(self, grasp: Grasp) -> Contact:
        """Return where the tip is when the object is grasped."""
        ahead = rotate(grasp.pose.rotation, (1.0, 0.0, 0.0))
        approach, lift = distance(self._goal.approach, WAY), distance(self._goal.lift, WAY)
        x, y, z = (-approach * part for part in ahead)
        return Contact(grasp.pose.compose(self.hand.grasp.inverse()), (x, y, z), (0.0, 0.0, lift), grasp.width)
