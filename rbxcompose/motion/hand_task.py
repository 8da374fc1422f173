"""Picks an object up or puts one down: stages one after the other, each of which may fail with a reason."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from dataclasses import replace
from typing import ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Quaternion, Transform3
from rbxcompose.motion.arm_goal import ArmGoal
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.arm_task import LONGEST_CALL, SETTLING, ArmSite, ArmTask
from rbxcompose.motion.collisions import Checker
from rbxcompose.motion.contacts import Contact, ContactCheckers, ContactSearch, ContactWay, NearChecker
from rbxcompose.motion.planner import MotionPlanner, MotionRequest, Planning
from rbxcompose.motion.reasons import GraspReason, MotionFailure, MotionReason, StageFailure
from rbxcompose.motion.scene import PlacedObject
from rbxcompose.motion.ways_ahead import ATTEMPTS, HelpedPlanner, PlansWithHelp, WaysAhead

Array = NDArray[np.float64]
T = TypeVar("T")
Work = Generator[None, None, StageFailure | None]

SPARE = 0.005  # [rad or m] to the limits of joints: curves through the poses of a line swing a little beyond them
TRIES = 256  # slices of a search in one call, unless it takes long: each is a few milliseconds, and there are hundreds
SLACK = 0.005  # [m] by which an opening may be less than it was told, or than the width of what is between the fingers
GAP = 0.005  # [m] below an object within which it stands on something


@dataclass(frozen=True, slots=True)
class Gripped:
    """How a command of the gripper ended: its opening [m], nan if unknown, and why it failed, if it did."""

    opening: float
    problem: str = ""


@dataclass(frozen=True, slots=True)
class Hand:
    """The gripper of an arm: the range of its openings [m], and the frame between its fingers in that of the tip."""

    least: float
    greatest: float
    grasp: Transform3
    links: tuple[str, ...]
    """The tip, and all links that it carries."""


class HandSite(ArmSite, Protocol):
    """What picking and placing need of the component beside what a motion needs."""

    @property
    def objects(self) -> tuple[PlacedObject, ...] | None:
        """Return the objects of the scene; None while they are unknown."""

    @property
    def uprights(self) -> dict[str, Quaternion]:
        """Return how objects stood in the root's frame when they were picked; it may be changed."""

    def grip(self, opening: float, ended: Callable[[Gripped], None]) -> None:
        """Open or close the gripper [m]."""

    def stop_gripping(self) -> None:
        """Ask the gripper to end; `ended` still follows."""

    def attach(self, name: str, link: str, ended: Callable[[str], None]) -> None:
        """Let an object move with a link; `ended` gets why that cannot be, or nothing."""

    def detach(self, name: str, ended: Callable[[str], None]) -> None:
        """Let an object stay where it is; `ended` gets why that cannot be, or nothing."""


class HandWorks(PlansWithHelp, Protocol):
    """What plans for an arm."""

    kinematics: ArmKinematics

    def checker(self, objects: Iterable[PlacedObject]) -> Checker:
        """Return a checker among these objects."""


class AlongPath(MotionPlanner):
    """A planner that knows the way: the points of a path, of shape (m, n), after where the arm is."""

    def __init__(self, planner: MotionPlanner, checker: Checker, path: Array) -> None:
        super().__init__(planner.space, checker, planner.settings, planner.now)
        self._path = path

    def plan(self, request: MotionRequest) -> Planning:
        """Return the path, timed and examined."""
        return self.along(self._path, request)


class HandTask:
    """Carries out one goal. Call `advance` until `is_over`; then `failure` is why it failed, if it did."""

    stages: ClassVar[tuple[str, ...]]
    """Names of its stages, in order; each is carried out by the method of that name."""

    def __init__(self, site: HandSite, works: HandWorks, hand: Hand, pace: ArmGoal) -> None:
        """Begin; `pace` has the shares of speed and acceleration."""
        self.failure: StageFailure | None = None
        self.is_over = self.is_canceled = False
        self.is_done = False  # nothing is left to do, although stages are
        self.stage = self.stages[0]
        self.site, self.works, self.hand, self._pace = site, works, hand, pace
        self.space, self.kinematics = works.planner.space, works.kinematics
        self._motion: ArmTask | None = None
        self._line: MotionPlanner | None = None
        self._watch: Callable[[], Checker] | None = None  # makes the checker of the line that is being followed
        self._grips = False
        self._work = self._carry_out()

    @property
    def held(self) -> PlacedObject | None:
        """Return the object that the arm holds."""
        return next((one for one in self.site.objects or () if one.link in self.hand.links), None)

    def advance(self) -> None:
        """Continue."""
        if not self.is_over:
            self.is_over = next(self._work, True) is True

    def cancel(self) -> None:
        """End it soon; an object that is held stays attached."""
        if self.is_canceled or self.is_over:
            return
        self.is_canceled = True
        if self._motion is not None:
            self._motion.cancel()
        elif self._grips:
            self.site.stop_gripping()

    def look_again(self) -> None:
        """Stop if what is left of a motion collides, now that something else is around the robot."""
        if self._motion is not None:
            if self._line is not None and self._watch is not None:
                self._line.checker = self._watch()
            self._motion.look_again()

    def _carry_out(self) -> Iterator[None]:
        for stage in self.stages:
            self.stage = stage
            self.site.told(self.stage)
            self.failure = yield from getattr(self, self.stage)()
            if self.is_canceled:
                self.failure = StageFailure(self.stage, MotionReason.INTERRUPTED, "it was cancelled")
            if self.failure is not None or self.is_done:
                return

    # What stages are made of

    def fail(self, reason: MotionReason | GraspReason, text: str) -> StageFailure:
        """Return the failure of this stage."""
        return StageFailure(self.stage, reason, text)

    def settle(self) -> Work:
        """Wait until the scene and all joints of the arm are known; the rest of the body is where it is now."""
        began = self.site.now
        while not self.site.is_ready or any(name not in self.site.measured for name in self.space.names):
            if self.site.now - began >= SETTLING:
                if not self.site.is_ready:
                    return self.fail(MotionReason.UNKNOWN_SCENE, "nothing has told what is around the robot")
                return self.fail(MotionReason.UNKNOWN_START, "nothing has reported where all joints of the arm are")
            yield
        self.place_body()
        return None

    def place_body(self) -> None:
        """Let the joints that the arm does not move be where they have been reported, fingers among them."""
        names = self.space.names
        self.kinematics.place({name: at for name, (at, _) in self.site.measured.items() if name not in names})

    @property
    def here(self) -> Array:
        """Return where the joints of the arm are."""
        return np.array([self.site.measured[name][0] for name in self.space.names])

    def object_named(self, name: str) -> PlacedObject | None:
        """Return an object of the scene."""
        return next((one for one in self.site.objects or () if one.name == name), None)

    def in_root(self, one: PlacedObject) -> Transform3:
        """Return where an object is now in the root's frame."""
        return self.kinematics.poses(self.here)[one.link].compose(one.pose)

    def without(self, name: str) -> list[PlacedObject]:
        """Return all other objects."""
        return [one for one in self.site.objects or () if one.name != name]

    def carried(self, one: PlacedObject, at: Transform3) -> PlacedObject:
        """Return an object as it moves with the hand, `at` in the frame of the tip."""
        return replace(one, link=self.hand.links[0], pose=at, touches=self.hand.links)

    def supports(self, one: PlacedObject, at: Transform3) -> tuple[str, ...]:
        """Return what an object touches that stands `at` in the root's frame, or is just above; the hand is away."""
        x, y, z = at.translation
        lower = Transform3((x, y, z - GAP), at.rotation)
        there = self.carried(one, self.kinematics.tip_pose(self.here).inverse().compose(lower))
        pairs = self.works.checker([*self.without(one.name), there]).colliding(self.here)
        return tuple(name for pair in pairs if one.name in pair for name in pair if name != one.name)

    def tolerant_near(self, held: PlacedObject, below: tuple[str, ...], tip: Transform3) -> Checker:
        """Return a checker with an object in the hand, which may touch what is `below` it near a pose of the tip."""
        others = self.without(held.name)
        strict = self.works.checker([*others, held])
        if not below:
            return strict
        touching = self.works.checker([*others, replace(held, touches=(*held.touches, *below))])
        return NearChecker(self.kinematics, strict, touching, tip.translation)

    def reached(
        self, contacts: Iterable[Contact], checkers: ContactCheckers, lines: tuple[str, str]
    ) -> Generator[None, None, ContactWay | StageFailure]:
        """Go to where the line to a contact begins, the first one that a motion is planned to, and return its way."""
        space = self.space.inside(SPARE)
        search = ContactSearch(self.kinematics, space, self.here, self.works.planner.settings.seed, lines)
        failure = self.fail(MotionReason.GOAL_OUT_OF_REACH, "there is no way to it")
        with closing(WaysAhead(search, contacts, checkers, self.works)) as ways:
            for attempt in range(ATTEMPTS):
                found = yield from self._worked(ways.next_way())
                if found is None or (attempt and isinstance(found, StageFailure)):
                    break
                if isinstance(found, StageFailure):
                    return found
                failed = yield from self._led(HelpedPlanner(self.works.planner, ways), found.coming[0], self._usual)
                if failed is None:
                    return found
                failure = self.fail(failed.reason, failed.text)
                if failed.reason not in (MotionReason.NO_PATH_IN_TIME, MotionReason.PATH_IN_COLLISION):
                    break
        return failure

    def _usual(self) -> Checker:
        return self.works.planner.checker

    def _worked(self, work: Generator[None, None, T]) -> Generator[None, None, T | StageFailure]:
        """Go on with some work until it has a result, or the goal is cancelled."""
        while not self.is_canceled:
            begin = self.site.now
            for _ in range(TRIES):
                try:
                    next(work)
                except StopIteration as ended:
                    result: T = ended.value
                    return result
                if self.site.now - begin >= LONGEST_CALL:
                    break
            yield
        return self.fail(MotionReason.INTERRUPTED, "it was cancelled")

    def follow(self, path: Array, watch: Callable[[], Checker]) -> Work:
        """Follow a path, examined by the checker that `watch` makes."""
        failed = yield from self._led(AlongPath(self.works.planner, watch(), path), path[-1], watch)
        return self.fail(failed.reason, failed.text) if failed is not None else None

    def _led(
        self, planner: MotionPlanner, end: Array, watch: Callable[[], Checker]
    ) -> Generator[None, None, MotionFailure | None]:
        """Move as a planner says; `watch` makes its checker again when something else is around the robot."""
        self._line, self._watch = planner, watch
        goal = replace(self._pace, positions=dict(zip(self.space.names, end.tolist(), strict=True)))
        self._motion = ArmTask(self.site, self.kinematics, planner, goal)
        while not self._motion.is_over:
            self._motion.advance()
            yield
        failure, self._motion = self._motion.failure, None
        self._line = self._watch = None
        return failure

    def gripped(self, opening: float) -> Generator[None, None, Gripped]:
        """Open or close the gripper."""
        self._grips = True
        wanted = min(max(opening, self.hand.least), self.hand.greatest)
        answers: list[Gripped] = []
        self.site.grip(wanted, answers.append)
        while not answers:
            yield
        self._grips = False
        return answers[0]

    def opened(self, opening: float) -> Work:
        """Open the gripper."""
        told = yield from self.gripped(opening)
        problem = told.problem
        if not problem and told.opening < min(opening, self.hand.greatest) - SLACK:
            problem = f"it opened to {told.opening * 1e3:.0f} of {opening * 1e3:.0f} mm"
        self.place_body()
        return self.fail(GraspReason.GRIPPER_FAILED, problem) if problem else None

    def changed(self, change: Callable[[Callable[[str], None]], None], is_done: Callable[[], bool]) -> Work:
        """Change the scene, and wait until its change has come."""
        answers: list[str] = []
        change(answers.append)
        began = self.site.now
        while not answers or not (answers[0] or is_done()):
            if self.site.now - began >= SETTLING:
                return self.fail(GraspReason.NOT_ATTACHED, "the scene has not told of it")
            yield
        return self.fail(GraspReason.NOT_ATTACHED, answers[0]) if answers[0] else None


def distance(length: float, usual: float) -> float:
    """Return a length of a goal [m]: 0 stands for the usual one."""
    return length if math.isfinite(length) and length > 0.0 else usual
