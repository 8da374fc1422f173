"""Picks an object up or puts it down: stages one after the other, each of which may fail with a reason."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import product
from typing import ClassVar, Protocol, TypeVar

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import (
    Quaternion,
    Transform3,
    Vector3,
    angle_between,
    conjugate,
    lerp,
    multiply,
    quaternion_from_yaw,
    rotate,
    slerp,
    yaw_of,
)
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.arm_task import SETTLING, ArmGoal, ArmSite, ArmTask, gone_on
from rbxcompose.domains.arms.motion.collisions import Checker, pairs_shown
from rbxcompose.domains.arms.motion.grasps import Grasp, grasps_of, reach_of, solid_of, widths_of
from rbxcompose.domains.arms.motion.groups import JointSpace, interpolated
from rbxcompose.domains.arms.motion.inverse_kinematics import TOLERANCE, PoseSearch, PoseTarget, descended, solved
from rbxcompose.domains.arms.motion.planner import RESOLUTION, MotionPlan, MotionPlanner, MotionRequest, Planning
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.reasons import GraspReason, MotionFailure, MotionReason, StageFailure
from rbxcompose.domains.body.link_pairs import LinkPair
from rbxcompose.domains.body.model import Geometry

STEP = 0.005  # [m] between poses of the tip
TURN = 0.1  # [rad] between them
JUMP = 0.5  # [rad or m] that a joint may move from one pose to the next
BESIDE = 2 * TOLERANCE  # [m] by which the tip may be off half way between two poses


@dataclass(frozen=True, slots=True)
class LineEnd:
    """How much of a line was followed, and why no more; nothing if that was all of it."""

    fraction: float
    problem: str = ""


def line_steps(
    kinematics: ArmKinematics, space: JointSpace, start: Array, goal: Transform3, step: float = STEP
) -> Generator[Array, None, LineEnd]:
    """Yield positions on the line from the tip's pose at `start` to `goal`, both in the root's frame, after `start`.

    The tip turns evenly on the way. Collisions are not looked at. `step` is the distance between poses [m].
    """
    here, last = kinematics.tip_pose(start), start
    away, angle = PoseTarget(goal).error(here)
    count = max(1, math.ceil(away / step), math.ceil(angle / TURN))
    for index in range(1, count + 1):
        share = index / count
        pose = Transform3(lerp(here.translation, goal.translation, share), slerp(here.rotation, goal.rotation, share))
        target = PoseTarget(pose)
        values, missed = descended(kinematics, space, target, last)
        jump = float(np.max(np.abs(values - last)))
        if not target.is_met(kinematics.tip_pose(values)):
            problem = (
                f"the line ends {missed[0] * 100:.1f} cm and {math.degrees(missed[1]):.1f} deg beside a pose on it"
            )
        elif jump > JUMP:
            problem = f"a joint would have to jump by {jump:.2f} rad"
        elif (beside := _off_half_way(kinematics, last, values, here, goal, share - 0.5 / count)) > BESIDE:
            problem = f"the tip would leave the line by {beside * 1e3:.1f} mm between two poses"
        else:
            yield values
            last = values
            continue
        return LineEnd((index - 1) / count, f"{problem}, at {(index - 1) / count:.0%} of the line")
    return LineEnd(1.0)


def _off_half_way(
    kinematics: ArmKinematics, before: Array, after: Array, here: Transform3, goal: Transform3, share: float
) -> float:
    """Return how far the tip is from its place on the line [m] when joints are half way between two poses."""
    at, wanted = kinematics.tip_pose((before + after) / 2).translation, lerp(here.translation, goal.translation, share)
    return math.dist(at, wanted)


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

    def leaving(self, contact: Contact) -> Checker:
        """Return the checker of the line from it."""


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
        failure = _farthest(failed)[1]
        return StageFailure(failure.stage, failure.reason, f"{failure.text} (the nearest of {len(failed)} poses)")

    def _way(self, contact: Contact, checkers: ContactCheckers) -> Generator[None, None, ContactWay | _Failed]:
        coming, (to, back) = checkers.coming(contact), self.stages
        target = PoseTarget(contact.at)
        start, is_free = self.start, coming.is_free
        solutions = yield from solved(
            PoseSearch(self.kinematics, self.space, target, start, is_free, self.seed, RESTARTS, ENOUGH)
        )
        if not solutions.free:
            if solutions.colliding:
                pairs = pairs_shown(coming.colliding(solutions.colliding[0]))
                return 1, StageFailure(to, MotionReason.GOAL_IN_COLLISION, pairs)
            return 0, StageFailure(to, MotionReason.GOAL_OUT_OF_REACH, solutions.miss)
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
            hit = next((item for item in between if not checker.is_free(item)), None)
            if hit is not None:
                failure = StageFailure(stage, MotionReason.PATH_IN_COLLISION, pairs_shown(checker.colliding(hit)))
                break
            free.append(values)
        here, end = (self.kinematics.tip_pose(array).translation for array in (start, free[-1]))
        if math.dist(here, end) >= min(LEAST, math.dist(here, goal.translation) - TOLERANCE):
            return np.array(free)
        return failure


def _farthest(failed: list[_Failed]) -> _Failed:
    return max(failed, key=lambda pair: pair[0])


ATTEMPTS = 5  # ways that are planned to, before it gives up
ALONE = 6  # slices of the first motion before others are looked for: an easy one takes 2 to 6
STEPS = 32  # of looking for others, for each slice: one takes a millisecond
NOISE = 0.01  # [rad or m] by which joints may be elsewhere than where a helper was sent: a servo has ticks

FoundWay = ContactWay | StageFailure | None
Planned = MotionPlan | MotionFailure


@dataclass(frozen=True, slots=True)
class PlanJob:
    """A motion that is to be planned elsewhere."""

    request: MotionRequest
    others: Mapping[str, float]
    """Positions of the joints that are not the arm's [rad or m]."""
    objects: tuple[PlacedObject, ...]
    paddings: Mapping[str, float]


class PlanningHelper(Protocol):
    """Plans elsewhere, one job at a time."""

    @property
    def is_idle(self) -> bool:
        """Return whether it can begin a job."""

    def begin(self, job: PlanJob) -> None:
        """Plan a motion."""

    def answer(self, job: PlanJob) -> Planned | None:
        """Return what was planned, once; None if that is not known yet, or never will be."""

    def abandon(self) -> None:
        """Let go of the job."""


class HandWorks(Protocol):
    """What plans for an arm among objects, and who helps it."""

    kinematics: ArmKinematics
    planner: MotionPlanner
    objects: tuple[PlacedObject, ...]
    paddings: Mapping[str, float]
    helpers: Sequence[PlanningHelper]

    def checker(self, objects: Iterable[PlacedObject]) -> Checker:
        """Return a checker among these objects."""


class _Found:
    """What was found, and who plans the motion to it."""

    def __init__(self, way: FoundWay) -> None:
        self.way = way
        self.job: PlanJob | None = None
        self.helper: PlanningHelper | None = None
        self.planned: Planned | None = None

    def look(self) -> None:
        """Take the motion that its helper has planned."""
        if self.helper is not None and self.job is not None:
            self.planned = self.helper.answer(self.job)
            self.helper = None if self.planned is not None else self.helper

    def let_go(self) -> None:
        """Forget the motion."""
        if self.helper is not None:
            self.helper.abandon()
        self.job = self.helper = self.planned = None


class WaysAhead:
    """One search for ways. Close it at the end."""

    def __init__(
        self, search: ContactSearch, contacts: Iterable[Contact], checkers: ContactCheckers, works: HandWorks
    ) -> None:
        self._search, self._contacts, self._checkers, self._works = search, list(contacts), checkers, works
        self._scene = (works.objects, works.paddings)
        self._now, self._count = _Found(None), 0  # what was asked for last, and how often
        self._later: list[_Found] = []
        self._looking = self._look(0)

    def next_way(self) -> Generator[None, None, FoundWay]:
        """Return what `ContactSearch.next_way` does; it yields while it works."""
        self._notice_changes()
        while not self._later:
            next(self._looking)
            yield
        self._now.let_go()
        self._now, self._count = self._later.pop(0), self._count + 1
        return self._now.way

    def plan(self, request: MotionRequest) -> Planning:
        """Plan a motion to the way that was returned last."""
        own, slices = self._works.planner.plan(request), 0
        while True:
            self._notice_changes()
            for one in (self._now, *self._later):
                one.look()
            if self._now.planned is not None and self._is_from(request):
                return self._now.planned
            try:
                next(own)
            except StopIteration as ended:
                planned: Planned = ended.value
                return planned
            slices += 1
            if self._works.helpers and (self._count > 1 or slices > ALONE):
                self._hand_out(request)
            yield

    def close(self) -> None:
        """Let helpers go."""
        for one in (self._now, *self._later):
            one.let_go()

    def _look(self, begin: int) -> Generator[None, None, None]:
        """Find one way after the other, among the contacts from one on."""
        rest, way = iter(self._contacts[begin:]), None
        while not self._later or isinstance(way, ContactWay):
            way = yield from self._search.next_way(rest, self._checkers)
            self._later.append(_Found(way))
            yield

    def _notice_changes(self) -> None:
        """Forget all that was found ahead once other objects are there."""
        if (scene := (self._works.objects, self._works.paddings)) == self._scene:
            return
        self.close()
        self._scene, self._later, way = scene, [], self._now.way
        last = way.contact if isinstance(way, ContactWay) else None
        self._looking = self._look(next((item for item, contact in enumerate(self._contacts, 1) if contact is last), 0))

    def _is_from(self, request: MotionRequest) -> bool:
        """Return whether the motion was planned from where all joints are."""
        job, others = self._now.job, self._search.kinematics.positions
        if job is None or job.others.keys() != others.keys():
            return False
        away = [*(request.start - job.request.start), *(others[name] - at for name, at in job.others.items())]
        return float(np.max(np.abs(away))) <= NOISE

    def _hand_out(self, request: MotionRequest) -> None:
        """Give idle helpers the motions to later ways, and look for more of these."""
        idle = [helper for helper in self._works.helpers if helper.is_idle]
        for one in self._later:
            if idle and one.job is None and isinstance(one.way, ContactWay):
                wanted = replace(request, goal=one.way.coming[0])
                one.job = PlanJob(wanted, self._search.kinematics.positions, *self._scene)
                one.helper = idle.pop(0)
                one.helper.begin(one.job)
        for _ in range(STEPS):
            if any(one.job is None for one in self._later) or self._count + len(self._later) >= ATTEMPTS:
                break  # there is one that the next idle helper gets
            next(self._looking, None)


class HelpedPlanner(MotionPlanner):
    """A planner whose motions may be planned elsewhere."""

    def __init__(self, planner: MotionPlanner, ways: WaysAhead) -> None:
        super().__init__(planner.space, planner.checker, planner.settings, planner.now, planner.unlikely)
        self._ways = ways

    def plan(self, request: MotionRequest) -> Planning:
        """Plan a motion to the way that was returned last."""
        return self._ways.plan(request)


T = TypeVar("T")
Work = Generator[None, None, StageFailure | None]

SPARE = 0.005  # [rad or m] to the limits of joints: curves through the poses of a line swing a little beyond them
TRIES = 256  # slices of a search in one call, unless it takes long: each is a few milliseconds, and there are hundreds
SLACK = (
    0.005  # [m] by which an opening may be less than was commanded, or than the width of what is between the fingers
)
AT_REST = 1e-3  # [rad/s or m/s] of a finger
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
    """The tip, and all other links that an object in the hand may touch."""


@dataclass(frozen=True, slots=True)
class PickedObject:
    """How an object was picked; lengths are in metres."""

    upright: Quaternion
    """How it stood in the root's frame."""
    closed: float
    """The opening to which the gripper was closed."""
    width: float
    """Of the object between the fingers."""


class HandSite(ArmSite, Protocol):
    """What picking and placing need of the component beside what a motion needs."""

    @property
    def objects(self) -> tuple[PlacedObject, ...] | None:
        """Return the objects of the scene; None while they are unknown."""

    @property
    def picked(self) -> dict[str, PickedObject]:
        """Return how objects were picked, by name; it may be changed."""

    def grip(self, opening: float, ended: Callable[[Gripped], None]) -> None:
        """Open or close the gripper [m]."""

    def stop_gripping(self) -> None:
        """Ask the gripper to end; `ended` still follows."""

    def attach(self, name: str, links: tuple[str, ...], ended: Callable[[str], None]) -> None:
        """Let an object move with the first of some links, all of which it may touch.

        `ended` gets why that cannot be, or nothing.
        """

    def detach(self, name: str, ended: Callable[[str], None]) -> None:
        """Let an object stay where it is; `ended` gets why that cannot be, or nothing."""


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
        return next((object_ for object_ in self.site.objects or () if object_.link in self.hand.links), None)

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
            self.site.report_stage(self.stage)
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
                    return self.fail(MotionReason.UNKNOWN_SCENE, "no planning scene has been received")
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
        return next((object_ for object_ in self.site.objects or () if object_.name == name), None)

    def in_root(self, thing: PlacedObject) -> Transform3:
        """Return where an object is now in the root's frame."""
        return self.kinematics.poses(self.here)[thing.link].compose(thing.pose)

    def without(self, name: str) -> list[PlacedObject]:
        """Return all other objects."""
        return [object_ for object_ in self.site.objects or () if object_.name != name]

    def carried(self, thing: PlacedObject, at: Transform3) -> PlacedObject:
        """Return an object as it moves with the hand, `at` in the frame of the tip."""
        return replace(thing, link=self.hand.links[0], pose=at, touches=self.hand.links)

    def supports(self, thing: PlacedObject, at: Transform3) -> tuple[str, ...]:
        """Return what an object touches that stands `at` in the root's frame, or is just above; the hand is away."""
        x, y, z = at.translation
        lower = Transform3((x, y, z - GAP), at.rotation)
        there = self.carried(thing, self.kinematics.tip_pose(self.here).inverse().compose(lower))
        pairs = self.works.checker([*self.without(thing.name), there]).colliding(self.here)
        return tuple(name for pair in pairs if thing.name in pair for name in pair if name != thing.name)

    def tolerant_near(self, held: PlacedObject, below: tuple[str, ...], tip: Transform3) -> Checker:
        """Return a checker with an object in the hand, which may touch what is `below` it near a pose of the tip."""
        others = self.without(held.name)
        strict = self.works.checker([*others, held])
        if not below:
            return strict
        touching = self.works.checker([*others, replace(held, touches=(*held.touches, *below))])
        return NearChecker(self.kinematics, strict, touching, tip.translation)

    def approached(self, contacts: Iterable[Contact], checkers: ContactCheckers, lines: tuple[str, str]) -> Work:
        """Go to where the line to a contact begins, the first one that a motion is planned to, and keep its way."""
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
                    self._way = found
                    return None
                failure = self.fail(failed.reason, failed.text)
                if failed.reason not in (MotionReason.NO_PATH_IN_TIME, MotionReason.PATH_IN_COLLISION):
                    break
        return failure

    def _usual(self) -> Checker:
        return self.works.planner.checker

    def _worked(self, work: Generator[None, None, T]) -> Generator[None, None, T | StageFailure]:
        """Carry out what takes many slices."""
        while not self.is_canceled:
            if done := gone_on(work, lambda: self.site.now, TRIES):
                return done[0]
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
        grip = yield from self.gripped(opening)
        problem = grip.problem
        if not problem and grip.opening < min(opening, self.hand.greatest) - SLACK:
            problem = f"it opened to {grip.opening * 1e3:.0f} of {opening * 1e3:.0f} mm"
        self.place_body()
        return self.fail(GraspReason.GRIPPER_FAILED, problem) if problem else None

    def changed(self, change: Callable[[Callable[[str], None]], None], is_done: Callable[[], bool]) -> Work:
        """Change the scene, and wait until its change has come."""
        answers: list[str] = []
        change(answers.append)
        began = self.site.now
        while not answers or not (answers[0] or is_done()):
            if self.site.now - began >= SETTLING:
                return self.fail(GraspReason.NOT_ATTACHED, "the scene has not confirmed it")
            yield
        return self.fail(GraspReason.NOT_ATTACHED, answers[0]) if answers[0] else None


def distance(length: float, usual: float) -> float:
    """Return a length of a goal [m]: 0 stands for the usual one."""
    return length if math.isfinite(length) and length > 0.0 else usual


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
        thing = self.object_named(self._goal.object)
        if thing is None:
            there = ", ".join(sorted(each.name for each in self.site.objects or ())) or "none"
            return self.fail(
                GraspReason.UNKNOWN_OBJECT, f"there is no object '{self._goal.object}' in the scene; there: {there}"
            )
        self._one, self._at, widest = thing, self.in_root(thing), self.hand.greatest
        self._below = self.supports(thing, self._at)
        if self._goal.grasps:
            given = sorted(self._goal.grasps, key=lambda each: -each.quality)
            self._grasps = [replace(each, pose=self._at.compose(each.pose)) for each in given if each.width < widest]
            widths = [each.width for each in given]
        elif (solid := solid_of(thing)) is not None:
            at, bearing = self._at.compose(solid.pose), self._bearing()
            self._grasps = grasps_of(solid.shape, at, bearing, widest)
            widths = widths_of(solid.shape, at, bearing)
        else:
            words = f"'{thing.name}' is neither a box nor a cylinder nor a sphere"
            return self.fail(GraspReason.NO_GRASPS, f"{words}, and the arm has no 'grasps' for it")
        if not widths:
            return self.fail(GraspReason.NO_GRASPS, f"'{thing.name}' leans: fingers close across upright sides")
        if not self._grasps:
            words = f"'{thing.name}' is {min(widths) * 100:.1f} cm wide where fingers hold it"
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
        failure = yield from self.approached(map(self._contact, self._grasps), self, ("grasp", "lift"))
        return failure if failure is None or not self._has_moved else None  # the next stage begins again

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
                self.site.report_stage(stage)
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
        thing = self.object_named(self._one.name)
        if thing is None:
            return True
        now = self.in_root(thing)
        away = math.dist(now.translation, self._at.translation)
        return away > MOVED or angle_between(now.rotation, self._at.rotation) > TURNED

    def close(self) -> Work:
        """Close the gripper on the object."""
        width = self._way.contact.width
        self._closed = width - max(0.0, self._goal.squeeze)
        grip = yield from self.gripped(self._closed)
        if grip.problem or self.is_canceled:
            yield from self.keep()
            return self.fail(GraspReason.GRIPPER_FAILED, grip.problem)
        if grip.opening < width - SLACK:
            words = f"the gripper closed to {grip.opening * 1e3:.0f} mm"
            text = f"{words}, and '{self._one.name}' is {width * 1e3:.0f} mm wide"
            yield from self.gripped(self._opening)  # so that the arm can leave
            return self.fail(GraspReason.NOTHING_GRASPED, text)
        return None

    def keep(self) -> Work:
        """Attach the object if fingers that were stopped come to rest at it, or so near that it would be in the way."""
        above, began = self.kinematics.body.joint_above, self.site.now
        fingers = {above[link].name for link in self.hand.links if link in above} - {*self.space.names}
        while self.site.now - began < SETTLING and any(
            name in fingers and abs(speed) > AT_REST for name, (_, speed) in self.site.measured.items()
        ):
            yield
        self.place_body()
        near = replace(self._one, padding=self._one.padding + SLACK / 2)
        pairs = self.works.checker([*self.without(near.name), near]).colliding(self.here)
        return (yield from self.attach()) if any(near.name in pair for pair in pairs) else None

    def attach(self) -> Work:
        """Let the object move with the tip."""
        self.place_body()
        name = self._one.name
        self.site.picked[name] = PickedObject(self._at.rotation, self._closed, self._way.contact.width)
        return self.changed(lambda ended: self.site.attach(name, self.hand.links, ended), lambda: self.held is not None)

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
        thing, goal = self.held, self._goal
        if goal.unknown:
            return self.fail(MotionReason.UNKNOWN_GOAL, goal.unknown)
        if thing is None:
            return self.fail(GraspReason.NOTHING_HELD, "it holds nothing")
        if (failure := (yield from self.felt(thing))) is not None:
            return failure
        if goal.frame and goal.frame not in self.kinematics.body.links:
            return self.fail(MotionReason.UNKNOWN_GOAL, f"there is no link '{goal.frame}'")
        if goal.on and (self.object_named(goal.on) is None or goal.on == thing.name):
            return self.fail(GraspReason.UNKNOWN_OBJECT, f"there is nothing '{goal.on}' to put it on")
        if not all(map(math.isfinite, (*goal.at, goal.tolerance))):
            return self.fail(MotionReason.UNKNOWN_GOAL, "the place is not finite")
        self._one = thing
        picked = self.site.picked.get(thing.name)
        self._upright = picked.upright if picked else (0.0, 0.0, 0.0, 1.0)
        middle = self._place(thing)
        if middle is None:
            words = f"how high '{thing.name}' and '{goal.on}' are is known of boxes, cylinders and spheres only"
            return self.fail(GraspReason.NO_GRASPS, f"{words}: say where, with x, y and z")
        self._middle = middle
        return None

    def felt(self, thing: PlacedObject) -> Work:
        """Close the gripper as when it picked the object, which it may have lost on the way."""
        if (picked := self.site.picked.get(thing.name)) is None:
            return None
        grip = yield from self.gripped(picked.closed)
        if grip.problem or grip.opening >= picked.width - SLACK:
            return self.fail(GraspReason.GRIPPER_FAILED, grip.problem) if grip.problem else None
        yield from self.changed(lambda ended: self.site.detach(thing.name, ended), lambda: self.held is None)
        words = f"'{thing.name}' was lost on the way"
        return self.fail(GraspReason.NOTHING_HELD, f"{words}: the gripper closes to {grip.opening * 1e3:.0f} mm")

    def _place(self, thing: PlacedObject) -> Vector3 | None:
        """Return where the object is to be in the root's frame; None if it is not known how high it would stand."""
        goal = self._goal
        if goal.on and (base := self.object_named(goal.on)) is not None:
            under = self.in_root(base)
            top, bottom = reach_of(base, under.rotation, UP), reach_of(thing, self._upright, DOWN)
            if top is None or bottom is None:
                return None
            top += bottom + ABOVE
            ahead = rotate(quaternion_from_yaw(yaw_of(under.rotation)), (goal.at[0], goal.at[1], goal.at[2] + top))
            x, y, z = (at + part for at, part in zip(under.translation, ahead, strict=True))
            return (x, y, z)
        frame = self.kinematics.poses(self.here)[goal.frame] if goal.frame else Transform3()
        return frame.apply(goal.at)

    def approach(self) -> Work:
        """Find a pose whose lines are free, and go above it."""
        return self.approached(self._contacts(), self, ("lower", "retreat"))

    def lower(self) -> Work:
        """Go straight down until the object stands."""
        contact = self._way.contact
        return self.follow(self._way.coming, lambda: self.coming(contact))

    def open(self) -> Work:
        """Let go."""
        across = rotate(self.hand.grasp.rotation, (0.0, 1.0, 0.0))
        back = rotate(self.hand.grasp.rotation, (0.0, -1.0, 0.0))
        sides = (reach_of(self._one, self._one.pose.rotation, vector) for vector in (across, back))
        known = [side for side in sides if side is not None]
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
        thing = self.object_named(self._one.name)
        return self._standing(self.in_root(thing)) if thing is not None else self.works.checker(self.site.objects or ())

    def _standing(self, at: Transform3) -> Checker:
        stands = replace(self._one, link=self.kinematics.body.root, pose=at, touches=self.hand.links)
        return self.works.checker([*self.without(stands.name), stands])

    def _contacts(self) -> Iterator[Contact]:
        """Yield poses of the tip in which the object stands at its place, the very point first."""
        x, y, z = self._middle
        radius = max(0.0, self._goal.tolerance)
        angles = [math.tau * index / AROUND for index in range(AROUND)] if radius else []
        points = [(x, y, z), *((x + radius * math.cos(angle), y + radius * math.sin(angle), z) for angle in angles)]
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
        turned = multiply(self._upright, conjugate(self._one.pose.rotation))
        ahead = rotate(multiply(turned, self.hand.grasp.rotation), (1.0, 0.0, 0.0))
        if abs(ahead[2]) > STEEP:
            return 0.0
        return math.atan2(point[1] - base[1], point[0] - base[0]) - math.atan2(ahead[1], ahead[0])
