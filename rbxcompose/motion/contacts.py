"""Where a hand meets an object: inverse kinematics there, and the straight lines to and from it."""

from __future__ import annotations

import math
from collections.abc import Collection, Generator, Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.link_pairs import LinkPair
from rbxcompose.body.model import Geometry
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3, Vector3
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.collisions import Checker, told
from rbxcompose.motion.inverse_kinematics import TOLERANCE, PoseTarget, solved
from rbxcompose.motion.joint_space import JointSpace, interpolated
from rbxcompose.motion.planner import RESOLUTION
from rbxcompose.motion.reasons import GraspReason, MotionReason, StageFailure
from rbxcompose.motion.straight_line import line_steps

Array = NDArray[np.float64]
RESTARTS, ENOUGH = 8, 2  # of the search for positions at one contact: there are many contacts
LEAST = 0.03  # [m] of a line that is enough, if no more of it is free
NEAR = 0.02  # [m] from where an object stands, within which it may touch what it stands on


@dataclass(frozen=True, slots=True)
class Contact:
    """A pose of the tip where a hand takes or leaves an object; it comes from `before` and goes to `after`."""

    at: Transform3
    before: Vector3
    after: Vector3
    """Both [m] from `at`, in the root's frame."""
    width: float = 0.0

    def moved(self, way: Vector3) -> Transform3:
        """Return the pose of the tip at the end of one of the ways."""
        x, y, z = (at + part for at, part in zip(self.at.translation, way, strict=True))
        return Transform3((x, y, z), self.at.rotation)


@dataclass(frozen=True, slots=True)
class ContactWay:
    """Positions of joints on the line to a contact and on that from it, each of shape (m, n)."""

    contact: Contact
    coming: Array
    leaving: Array


class ContactCheckers(Protocol):
    """Who examines the lines of a contact."""

    def coming(self, contact: Contact) -> Checker:
        """Return the checker of the line to it, and of its end."""
        ...

    def leaving(self, contact: Contact) -> Checker:
        """Return the checker of the line from it."""
        ...


class NearChecker:
    """A checker that is replaced by a more tolerant one where the tip is near a point."""

    def __init__(self, kinematics: ArmKinematics, strict: Checker, tolerant: Checker, point: Vector3) -> None:
        self._kinematics, self._strict, self._tolerant, self._point = kinematics, strict, tolerant, point

    def is_free(self, values: Array) -> bool:
        """Return whether nothing collides."""
        return self._one(values).is_free(values)

    def colliding(self, values: Array) -> list[LinkPair]:
        """Return all pairs that collide."""
        return self._one(values).colliding(values)

    def without(self, pairs: Collection[LinkPair]) -> Checker:
        """Return a checker that does not watch some pairs."""
        return NearChecker(self._kinematics, self._strict.without(pairs), self._tolerant.without(pairs), self._point)

    def in_the_way(self, values: Array, shape: Geometry, at: Transform3, ignored: Collection[str]) -> list[str]:
        """Return the links and objects that a shape is within."""
        return self._one(values).in_the_way(values, shape, at, ignored)

    def _one(self, values: Array) -> Checker:
        away = math.dist(self._kinematics.tip_pose(values).translation, self._point)
        return self._tolerant if away <= NEAR else self._strict


_Failed = tuple[int, StageFailure]  # how far it got, and why no farther


@dataclass(frozen=True, slots=True)
class ContactSearch:
    """The search for contacts that an arm can come to and leave."""

    kinematics: ArmKinematics
    space: JointSpace
    start: Array
    seed: int
    stages: tuple[str, str]
    """Names of the lines to a contact and from it, for failures."""

    def next_way(
        self, contacts: Iterator[Contact], checkers: ContactCheckers
    ) -> Generator[None, None, ContactWay | StageFailure | None]:
        """Return the way of the next contact that has one, or the failure of the one that got farthest.

        Without any contact it returns None; it yields while it works.
        """
        failed: list[_Failed] = []
        for contact in contacts:
            way = yield from self._way(contact, checkers)
            if isinstance(way, ContactWay):
                return way
            failed.append(way)
        if not failed:
            return None
        one = _farthest(failed)[1]
        return StageFailure(one.stage, one.reason, f"{one.text} (the nearest of {len(failed)} poses)")

    def _way(self, contact: Contact, checkers: ContactCheckers) -> Generator[None, None, ContactWay | _Failed]:
        coming, (to, back) = checkers.coming(contact), self.stages
        target = PoseTarget(contact.at)
        solutions = yield from solved(
            self.kinematics,
            self.space,
            target,
            self.start,
            coming.is_free,
            seed=self.seed,
            restarts=RESTARTS,
            enough=ENOUGH,
        )
        if not solutions.free:
            if solutions.colliding:
                pairs = told(coming.colliding(solutions.colliding[0]))
                return 1, StageFailure(to, MotionReason.GOAL_IN_COLLISION, pairs)
            away, angle = solutions.nearest
            text = f"the tip got within {away * 100:.1f} cm and {math.degrees(angle):.1f} deg of it"
            return 0, StageFailure(to, MotionReason.GOAL_OUT_OF_REACH, text)
        leaving, failed = checkers.leaving(contact), list[_Failed]()
        for values in solutions.free:
            come = self._line(to, values, contact.moved(contact.before), coming)
            if isinstance(come, StageFailure):
                failed.append((2, come))
                continue
            leave = self._line(back, values, contact.moved(contact.after), leaving)
            if isinstance(leave, StageFailure):
                failed.append((3, leave))
            else:
                return ContactWay(contact, come[::-1], leave)
            yield
        return _farthest(failed)

    def _line(self, stage: str, start: Array, goal: Transform3, checker: Checker) -> Array | StageFailure:
        """Return as much of a line as is free, or why that is too short; behind what collides it is not followed."""
        steps, free = line_steps(self.kinematics, self.space, start, goal), [start]
        while True:
            try:
                values = next(steps)
            except StopIteration as ended:
                failure = StageFailure(stage, GraspReason.LINE_OUT_OF_REACH, ended.value.problem)
                break
            between = interpolated((free[-1], values), RESOLUTION)
            hit = next((one for one in between if not checker.is_free(one)), None)
            if hit is not None:
                failure = StageFailure(stage, MotionReason.PATH_IN_COLLISION, told(checker.colliding(hit)))
                break
            free.append(values)
        here, end = (self.kinematics.tip_pose(one).translation for one in (start, free[-1]))
        if math.dist(here, end) >= min(LEAST, math.dist(here, goal.translation) - TOLERANCE):
            return np.array(free)
        return failure


def _farthest(failed: list[_Failed]) -> _Failed:
    return max(failed, key=lambda one: one[0])
