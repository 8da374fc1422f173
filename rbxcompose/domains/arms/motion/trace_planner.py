"""From points of the tip to a trajectory along straight lines and arcs between them, verified."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate, pairwise

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Quaternion, Transform3, Vector3, angle_between, conjugate, lerp, multiply, slerp
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import Checker, pairs_shown
from rbxcompose.domains.arms.motion.groups import JointSpace
from rbxcompose.domains.arms.motion.inverse_kinematics import ANGLE_TOLERANCE, TOLERANCE, PoseTarget, descended
from rbxcompose.domains.arms.motion.parametrisation import MARGIN, Trajectory, jerks_of, speeds_of, timed
from rbxcompose.domains.arms.motion.planner import FINE, MotionPlan, MotionPlanner, Planning, examined, mistake_in_start
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason

TURN = 0.1  # [m/rad]
SAME = 1e-6  # [m or rad] between poses that are the same
CORNER_STEPS = 200  # of the table of its lengths
STRAIGHT = 1e-3  # [rad] between lines that are one
SMOOTH = math.radians(0.1)  # between directions, or of turns, that need no rest


class WrongWayError(ValueError):
    """Raised for points through which no way leads, with the reason."""


@dataclass(frozen=True, slots=True)
class WayPoint:
    """A pose of the tip; `is_via` if it is in the middle of an arc, which ends at the next one."""

    pose: Transform3
    is_via: bool = False


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line, on which the tip turns evenly."""

    first: Transform3
    last: Transform3

    @property
    def length(self) -> float:
        """Return how long it is [m]."""
        turned = angle_between(self.first.rotation, self.last.rotation)
        return max(math.dist(self.first.translation, self.last.translation), TURN * turned)

    def at(self, share: float) -> Transform3:
        """Return the pose there."""
        return Transform3(
            lerp(self.first.translation, self.last.translation, share),
            slerp(self.first.rotation, self.last.rotation, share),
        )


@dataclass(frozen=True, slots=True)
class Arc:
    """A part of a circle, `angle` [rad] long, on which the tip turns evenly.

    From the middle, `x` leads to its beginning, and `y` is where it goes from there, as long as the radius [m].
    """

    middle: Array
    x: Array
    y: Array
    angle: float
    first: Quaternion
    last: Quaternion

    @property
    def length(self) -> float:
        """Return how long it is [m]."""
        return max(self.angle * float(np.linalg.norm(self.x)), TURN * angle_between(self.first, self.last))

    def at(self, share: float) -> Transform3:
        """Return the pose there."""
        turn = self.angle * share
        x, y, z = (self.middle + self.x * math.cos(turn) + self.y * math.sin(turn)).tolist()
        return Transform3((x, y, z), slerp(self.first, self.last, share))


@dataclass(frozen=True, slots=True)
class Corner:
    """A parabola from one line to another, as a Bezier curve of three poses; it begins and ends as the lines go."""

    first: Transform3
    corner: Transform3
    last: Transform3
    lengths: Array
    """From its beginning to even steps of the curve's parameter [m]."""

    @classmethod
    def between(cls, first: Transform3, corner: Transform3, last: Transform3) -> Corner:
        """Return the corner with its lengths."""
        shares = np.linspace(0.0, 1.0, CORNER_STEPS + 1)[:, None]
        a, b, c = (np.array(one.translation) for one in (first, corner, last))
        points = a * (1 - shares) ** 2 + 2 * b * shares * (1 - shares) + c * shares**2
        lengths = np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))
        return cls(first, corner, last, np.concatenate(([0.0], lengths)))

    @property
    def length(self) -> float:
        """Return how long it is [m]."""
        return float(self.lengths[-1])

    def at(self, share: float) -> Transform3:
        """Return the pose there."""
        steps = np.linspace(0.0, 1.0, CORNER_STEPS + 1)
        inner = float(np.interp(share * self.length, self.lengths, steps))
        before, after = Line(self.first, self.corner).at(inner), Line(self.corner, self.last).at(inner)
        return Line(before, after).at(inner)


Leg = Line | Arc | Corner
"""A piece of a way: its length [m], and its poses at shares from 0 to 1."""


@dataclass(frozen=True, slots=True)
class TipStretch:
    """Legs that the tip passes without coming to rest between them."""

    legs: tuple[Leg, ...]

    @property
    def length(self) -> float:
        """Return how long it is [m]."""
        return sum(leg.length for leg in self.legs)

    @property
    def ends(self) -> list[float]:
        """Return at which lengths its legs end [m]."""
        return list(accumulate(leg.length for leg in self.legs))

    def at(self, length: float) -> Transform3:
        """Return the pose there; beyond an end it is that of the end."""
        for leg in self.legs:
            if length <= leg.length or leg is self.legs[-1]:
                return leg.at(min(1.0, max(0.0, length / leg.length)))
            length -= leg.length
        raise AssertionError("a stretch has legs")


def stretches(start: Transform3, points: Sequence[WayPoint], blend: float) -> tuple[TipStretch, ...]:
    """Return the way from `start` through points; corners of lines are cut from `blend` [m] before them on.

    The tip comes to rest where two stretches meet. Points where it is already are left out.

    Raises:
        WrongWayError: if an arc has no end or is none, or if a corner is longer than its legs.
    """
    return tuple(_joined(_cut(list(_legs(start, points)), blend)))


def _legs(start: Transform3, points: Sequence[WayPoint]) -> Iterator[Leg]:
    here, via = start, None
    for number, point in enumerate(points, 1):
        if via is not None and point.is_via:
            raise WrongWayError(f"point {number} is another one in the middle of an arc")
        if point.is_via:
            via = point.pose
            continue
        leg = Line(here, point.pose) if via is None else _arc(here, via, point.pose, number)
        if leg.length > SAME:
            yield leg
        here, via = point.pose, None
    if via is not None:
        raise WrongWayError("the last point is in the middle of an arc, which has no end")


def _arc(start: Transform3, via: Transform3, end: Transform3, number: int) -> Arc:
    """Return the arc through three points; how the tip is turned at the one in the middle does not count."""
    a, b, c = (np.array(one.translation) for one in (start, via, end))
    first, second = b - a, c - a
    normal = np.cross(first, second)
    square = float(normal @ normal)
    if square <= (STRAIGHT * float(np.linalg.norm(first) * np.linalg.norm(second))) ** 2:
        raise WrongWayError(f"the arc to point {number} is none: its three points are in one line")
    middle = a + np.cross((first @ first) * second - (second @ second) * first, normal) / (2.0 * square)
    x = a - middle
    y = np.cross(normal / math.sqrt(square), x)
    angle = math.atan2(float((c - middle) @ y), float((c - middle) @ x)) % math.tau
    return Arc(middle, x, y, angle, start.rotation, end.rotation)


def _cut(legs: list[Leg], blend: float) -> list[Leg]:
    """Return the legs with an arc at each corner of two lines."""
    cut = [_can_cut(one, other) and blend > 0.0 for one, other in pairwise(legs)]
    found: list[Leg] = []
    for number, leg in enumerate(legs):
        before, after = number > 0 and cut[number - 1], number < len(cut) and cut[number]
        if not isinstance(leg, Line) or not (before or after):
            found.append(leg)
            continue
        away = _reach(leg)
        if away < blend * (before + after) - SAME:
            text = f"line {number + 1} is {away * 100:.1f} cm long, too short for corners of {blend * 100:.1f} cm"
            raise WrongWayError(text)
        inner = Line(leg.at(blend / away) if before else leg.first, leg.at(1.0 - blend / away) if after else leg.last)
        if inner.length > SAME:
            found.append(inner)
        if after:
            next_ = legs[number + 1]
            found.append(Corner.between(inner.last, leg.last, next_.at(blend / _reach(next_))))
    return found


def _reach(leg: Leg) -> float:
    return math.dist(leg.at(0.0).translation, leg.at(1.0).translation)


def _can_cut(leg: Leg, other: Leg) -> bool:
    """Return whether two lines have a corner between them that is no turn on the spot and not back."""
    if not (isinstance(leg, Line) and isinstance(other, Line)):
        return False
    first, second = _direction(leg, 0.5), _direction(other, 0.5)
    cosine = float(first @ second)
    return bool(first.any() and second.any()) and -math.cos(SMOOTH) < cosine


def _joined(legs: list[Leg]) -> Iterator[TipStretch]:
    """Yield the legs, in one stretch if one goes on where the other went to, and turns as fast."""
    together: list[Leg] = []
    for leg in legs:
        if together and not _goes_on(together[-1], leg):
            yield TipStretch(tuple(together))
            together = []
        together.append(leg)
    if together:
        yield TipStretch(tuple(together))


def _goes_on(leg: Leg, other: Leg) -> bool:
    before, after = _velocity(leg, 1.0 - 1e-4), _velocity(other, 1e-4)
    return float(np.linalg.norm(before - after)) < 0.02


def _velocity(leg: Leg, share: float) -> Array:
    """Return how the tip moves [m/m] and turns [rad/m times TURN] per length, of shape (6,)."""
    step = 1e-4
    here, there = leg.at(share - step / 2), leg.at(share + step / 2)
    x, y, z, w = multiply(there.rotation, conjugate(here.rotation))
    turned = 2.0 * TURN * math.copysign(1.0, w) * np.array((x, y, z))
    moved = np.subtract(there.translation, here.translation)
    return np.concatenate((moved, turned)) / (step * leg.length)


def _direction(leg: Leg, share: float) -> Array:
    """Return where the tip moves, of length 1; 0 if it only turns."""
    moved = _velocity(leg, share)[:3]
    size = float(np.linalg.norm(moved))
    return moved / size if size > SAME else np.zeros(3)


def shifted(pose: Transform3, frame: Transform3, by: Vector3, turn: Quaternion) -> Transform3:
    """Return a pose that is moved by a vector [m], and turned in its place, both along the axes of a frame."""
    moved = np.add(pose.translation, replace(frame, translation=(0.0, 0.0, 0.0)).apply(by)).tolist()
    turned = multiply(multiply(frame.rotation, turn), multiply(conjugate(frame.rotation), pose.rotation))
    return Transform3((moved[0], moved[1], moved[2]), turned)


STEP, LEAST = 5e-3, 5e-5  # [m] from one position to the next
FOUND, FOUND_ANGLE = 1e-4, math.radians(0.05)  # [m], [rad] from the way at each step
MIDDLE, MIDDLE_ANGLE = 2e-4, math.radians(0.1)  # [m], [rad] from the way between steps
AT_LIMIT = 1e-6  # [rad or m]


@dataclass(frozen=True, slots=True)
class Traced:
    """Positions of joints, of shape (m, n), at `lengths` [m] of shape (m,), and why they end early, if they do."""

    values: Array
    lengths: Array
    problem: str = ""


def traced(
    kinematics: ArmKinematics,
    space: JointSpace,
    checker: Checker,
    way: TipStretch,
    start: Array,
    *,
    any_orientation: bool,
    step: float = STEP,
) -> Generator[None, None, Traced]:
    """Return positions that lead the tip along a way as far as that is possible; it yields after each step."""
    values, lengths, here, problem = [start], [0.0], 0.0, ""
    stops, most = [*way.ends], step
    while here < way.length - LEAST / 2:
        end = next((stop for stop in stops if stop > here + LEAST / 2), way.length)  # no step is across a corner
        there = min(here + step, end)
        found = _stepped(kinematics, space, checker, way, values[-1], (here, there), any_orientation)
        if isinstance(found, str):
            problem, step = found, step / 2
            if step < LEAST:
                return Traced(np.array(values), np.array(lengths), problem)
        else:
            values.append(found)
            lengths.append(there)
            here, step = there, min(most, step * 2)
        yield
    return Traced(np.array(values), np.array(lengths))


def _stepped(
    kinematics: ArmKinematics,
    space: JointSpace,
    checker: Checker,
    way: TipStretch,
    last: Array,
    step: tuple[float, float],
    any_orientation: bool,
) -> Array | str:
    """Return the positions at the end of a step, or why there are none."""
    target = PoseTarget(way.at(step[1]), any_orientation, FOUND, FOUND_ANGLE)
    values, _ = descended(kinematics, space, target, last)
    if not target.is_met(kinematics.tip_pose(values)):
        return _limit(space, values) or "the arm does not reach farther"
    half = PoseTarget(way.at(sum(step) / 2), any_orientation, MIDDLE, MIDDLE_ANGLE)
    if not half.is_met(kinematics.tip_pose((last + values) / 2)):
        index = int(np.argmax(np.abs(values - last)))
        words = space.joints[index].shown(float(abs(values - last)[index]))
        return f"'{space.names[index]}' would jump by {words}"
    return values if checker.is_free(values) else f"{pairs_shown(checker.colliding(values))} collide"


def _limit(space: JointSpace, values: Array) -> str:
    """Return which joints are at a limit, in words."""
    beyond = np.minimum(np.abs(values - space.lower), np.abs(space.upper - values)) < AT_LIMIT
    names = [f"'{joint.name}'" for joint, is_there in zip(space.joints, beyond, strict=True) if is_there]
    return f"{' and '.join(names)} {'is' if len(names) == 1 else 'are'} at a limit" if names else ""


def strayed(
    kinematics: ArmKinematics, way: TipStretch, values: Array, lengths: Array, any_orientation: bool
) -> tuple[float, float]:
    """Return how far the tip is from the way at most [m, rad], at positions (m, n) for `lengths` (m,)."""
    errors = [
        PoseTarget(way.at(length), any_orientation).error(kinematics.tip_pose(value))
        for value, length in zip(values, lengths.tolist(), strict=True)
    ]
    return max(value for value, _ in errors), max(value for _, value in errors)


ROUNDS = 3  # of taking smaller steps, so that the curves keep closer to the way
SECONDS_TO_SPEED = 0.2  # [s] in which the tip reaches its speed
ANY_SPEED = 1e3  # [m/s] of a tip that may be as fast as the joints are
MOST_STEPS = 20_000  # along one way; a limit where no time passes


@dataclass(frozen=True, slots=True)
class TraceWish:
    """What is asked for: the tip goes from where it is through points."""

    points: tuple[WayPoint, ...]
    """Poses in a frame, or shifts along its axes and turns about them."""
    relative: bool = False
    keep_orientation: bool = False
    any_orientation: bool = False
    speed: float = ANY_SPEED
    """Of the tip [m/s]."""
    blend: float = 0.0
    """How far before a corner the tip begins to cut it [m]."""
    least: float = 1.0
    """Share of the way that must be possible for the arm to move at all."""
    acceleration: float = 1.0
    """Share of the greatest accelerations of joints."""

    @property
    def mistake(self) -> str:
        """Return why it is no way; nothing if it is one."""
        if not self.points:
            return "there are no points to go through"
        for number, point in enumerate(self.points, 1):
            if words := PoseTarget(point.pose).mistake:
                return f"{words}: point {number}"
        if not self.speed > 0.0 or not self.blend >= 0.0 or math.isinf(self.blend):
            return "the speed is not above 0, or the blend is less"
        return "" if 0.0 < self.least <= 1.0 else f"{self.least:.0%} is no share of a way"

    def poses(self, start: Transform3, frame: Transform3) -> tuple[WayPoint, ...]:
        """Return the points in the frame of the root, for a tip that begins at `start`."""
        found = []
        for point in self.points:
            if self.relative:
                pose = shifted(start, frame, point.pose.translation, point.pose.rotation)
            else:
                pose = frame.compose(point.pose)
            if self.keep_orientation:
                pose = replace(pose, rotation=start.rotation)
            found.append(WayPoint(pose, point.is_via))
        return tuple(found)


def planned_trace(
    kinematics: ArmKinematics, planner: MotionPlanner, wish: TraceWish, start: Array, frame: Transform3
) -> Planning:
    """Return a plan or why there is none, as `MotionPlanner.plan` does, from positions of joints of shape (n,)."""
    failure = mistake_in_start(planner.space, planner.checker, start)
    if failure is not None:
        return failure
    start = planner.space.clamped(start)
    tip = kinematics.tip_pose(start)
    try:
        ways = stretches(tip, wish.poses(tip, frame), wish.blend)
    except WrongWayError as error:
        return MotionFailure(MotionReason.UNKNOWN_GOAL, str(error))
    if not ways:
        return MotionPlan(None, np.stack((start, start)), 0, 0)
    return (yield from _Trace(kinematics, planner, wish, ways).plan(start))


class _Trace:
    """One wish."""

    def __init__(
        self, kinematics: ArmKinematics, planner: MotionPlanner, wish: TraceWish, ways: tuple[TipStretch, ...]
    ) -> None:
        self._kinematics, self._planner, self._wish, self._ways = kinematics, planner, wish, ways
        self._began, self._steps = planner.now(), 0
        self._total = sum(way.length for way in ways)

    def plan(self, start: Array) -> Planning:
        """Find the way and verify it, with smaller steps if its curves stray."""
        failure = MotionFailure(MotionReason.NO_PATH_IN_TIME, "")
        for number in range(ROUNDS):
            found = yield from self._found(start, STEP / 2**number)
            if isinstance(found, MotionFailure):
                return found
            parts, share = found
            made = yield from self._verified(parts)
            if isinstance(made, Trajectory):
                points = np.concatenate([part.values for part in parts])
                return MotionPlan(made, points, number + 1, self._steps, share)
            failure = made
        return failure

    def _found(self, start: Array, step: float) -> Generator[None, None, tuple[list[Traced], float] | MotionFailure]:
        """Return the positions of each stretch, and the share of the way that they are."""
        parts: list[Traced] = []
        problem = ""
        for way in self._ways:
            tracing = traced(
                self._kinematics,
                self._planner.space,
                self._planner.checker,
                way,
                start,
                any_orientation=self._wish.any_orientation,
                step=step,
            )
            found: Traced | None = None
            while found is None:
                if self._planner.now() - self._began >= self._planner.settings.time or self._steps >= MOST_STEPS:
                    text = f"no way was found in {self._planner.settings.time:g} s, after {self._steps} steps"
                    return MotionFailure(MotionReason.NO_PATH_IN_TIME, text)
                try:
                    next(tracing)
                except StopIteration as ended:
                    found = ended.value
                self._steps += 1
                yield
            if len(found.values) > 1:
                parts.append(found)
            start = found.values[-1]
            if problem := found.problem:
                break
        share = sum(float(part.lengths[-1]) for part in parts) / self._total
        if problem and (share < self._wish.least or not parts):
            return MotionFailure(MotionReason.PATH_INCOMPLETE, f"only {share:.1%} of the way: {problem}", share)
        return parts, share if problem else 1.0

    def _verified(self, parts: list[Traced]) -> Generator[None, None, Trajectory | MotionFailure]:
        made = []
        for way, part in zip(self._ways, parts, strict=False):
            found = yield from self._timed(way, part)
            if isinstance(found, MotionFailure):
                return found
            made.append(found)
        return joined(made)

    def _timed(self, way: TipStretch, part: Traced) -> Generator[None, None, Trajectory | MotionFailure]:
        """Return the trajectory along one stretch, whose length is led like a joint, so that its speed is kept."""
        planner, wish = self._planner, self._wish
        fast, hard = speeds_of(planner.space, 1.0, wish.acceleration)
        tip = wish.speed / MARGIN
        jerks = jerks_of(planner.space)
        found = timed(
            np.column_stack((part.values, part.lengths)),
            np.append(fast, tip),
            np.append(hard, tip / SECONDS_TO_SPEED),
            None if jerks is None else np.append(jerks, np.inf),
        )
        if isinstance(found, str):
            return MotionFailure(MotionReason.NO_TIMING, found)
        points = found.dense(FINE)
        self._steps += len(points)
        rejected = yield from examined(points[:, :-1], planner.space, planner.checker)
        if rejected is not None:
            return MotionFailure(MotionReason.PATH_IN_COLLISION, rejected.text)
        away, angle = strayed(self._kinematics, way, points[:, :-1], points[:, -1], wish.any_orientation)
        if away > TOLERANCE or angle > ANGLE_TOLERANCE:
            text = f"its curves are up to {away * 1000:.1f} mm and {math.degrees(angle):.1f} deg off the way"
            return MotionFailure(MotionReason.PATH_INCOMPLETE, text)
        return Trajectory(found.times, found.positions[:, :-1], found.velocities[:, :-1])


def joined(parts: list[Trajectory]) -> Trajectory:
    """Return trajectories one after the other; each begins where the last one ends, at rest."""
    times, ends = [parts[0].times], parts[0].duration
    for trajectory in parts[1:]:
        times.append(trajectory.times[1:] + ends)
        ends += trajectory.duration
    rest = parts[1:]
    return Trajectory(
        np.concatenate(times),
        np.concatenate([parts[0].positions, *(part.positions[1:] for part in rest)]),
        np.concatenate([parts[0].velocities, *(part.velocities[1:] for part in rest)]),
    )
