"""Joint trajectories: what is wrong with one before it moves anything, and the curves of its joints within limits."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import field, replace
from enum import IntEnum
from operator import itemgetter
from typing import Literal

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.curves import (
    Curve,
    JointSample,
    calmed_velocities,
    cubic,
    quintic,
    spline_velocities,
    straight,
)
from rbxcompose.domains.servos.limits import MotionLimits


class TrajectoryCode(IntEnum):
    """How a trajectory ended, with the numbers of `control_msgs/action/FollowJointTrajectory`."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


@dataclass(frozen=True, slots=True)
class TrajectoryPoint:
    """Where the joints are at a time; empty velocities or accelerations are not given."""

    time: float
    """[s] since the trajectory starts. At 0 it means: as fast as the limits allow."""
    positions: tuple[float, ...]
    velocities: tuple[float, ...] = ()
    accelerations: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class TrajectoryTolerance:
    """How far a joint may be from where it should be; None is not checked."""

    path: float | None = None
    """On the way [rad or m]."""
    goal: float | None = 0.05
    """At the end [rad or m]."""
    velocity: float | None = 0.01
    """At the end it must be slower than this [rad/s or m/s]."""


@dataclass(frozen=True, slots=True)
class TrajectoryGoal:
    """A trajectory of some joints, in their order."""

    joints: tuple[str, ...]
    points: tuple[TrajectoryPoint, ...]
    start: float = 0.0
    """When it starts; 0 is now. Then it replaces what runs."""
    tolerances: Mapping[str, TrajectoryTolerance] = field(default_factory=dict)
    """In place of those of the policy."""
    goal_time: float | None = None
    """In place of that of the policy [s]."""


@dataclass(frozen=True, slots=True)
class TrajectoryPolicy:
    """How trajectories are read and followed."""

    interpolation: Literal["auto", "linear"] = "auto"
    """Between points without velocities: `auto` is a C2 spline that ends at rest, `linear` are straight lines."""
    outside: Literal["refuse", "clamp"] = "refuse"
    """What to do with positions outside of the limits."""
    too_fast: Literal["refuse", "stretch"] = "refuse"
    """What to do with a trajectory above the limits of velocity: `stretch` takes more time."""
    tolerance: TrajectoryTolerance = TrajectoryTolerance()
    goal_time: float = 1.0
    """How long after its end the joints may take to arrive [s]; inf waits for ever."""


@dataclass(frozen=True, slots=True)
class TrajectoryRefusal:
    """Why a trajectory is not followed."""

    code: TrajectoryCode
    message: str
    joint: str = ""


def mistake_in(goal: TrajectoryGoal, known: Collection[str]) -> TrajectoryRefusal | None:
    """Return what is wrong with the goal, whatever the limits and the state of the `known` joints are."""
    return next(itertools.chain(_joints(goal, known), _shapes(goal), _times(goal), _fields(goal)), None)


def _joints(goal: TrajectoryGoal, known: Collection[str]) -> Iterator[TrajectoryRefusal]:
    twice = next((name for name, count in Counter(goal.joints).items() if count > 1), None)
    unknown = next((name for name in goal.joints if name not in known), None)
    code = TrajectoryCode.INVALID_JOINTS
    if not goal.joints:
        yield TrajectoryRefusal(code, "it names no joints")
    if twice is not None:
        yield TrajectoryRefusal(code, f"joint '{twice}' is named twice", twice)
    if unknown is not None:
        yield TrajectoryRefusal(code, f"joint '{unknown}' is unknown; there are {', '.join(known)}", unknown)


def _shapes(goal: TrajectoryGoal) -> Iterator[TrajectoryRefusal]:
    if not goal.points:
        yield _invalid("it has no points")
    if not math.isfinite(goal.start):
        yield _invalid(f"its start {goal.start} is not a finite number")
    for index, point in enumerate(goal.points):
        if not math.isfinite(point.time):
            yield _invalid(f"the time of point {index} is {point.time}")
        for name in ("positions", "velocities", "accelerations"):
            values = getattr(point, name)
            if len(values) != len(goal.joints) and (values or name == "positions"):
                yield _invalid(f"point {index} has {len(values)} {name} for {len(goal.joints)} joints")
            for joint, value in zip(goal.joints, values, strict=False):
                if not math.isfinite(value):
                    yield _invalid(f"point {index} has {value} among its {name}", joint)


def _times(goal: TrajectoryGoal) -> Iterator[TrajectoryRefusal]:
    if goal.points and goal.points[0].time < 0.0:
        yield _invalid(f"point 0 is at {goal.points[0].time:g} s, before the start")
    for index, (before, after) in enumerate(itertools.pairwise(goal.points), 1):
        if after.time == before.time:
            yield _invalid(f"points {index - 1} and {index} are both at {after.time:g} s")
        if after.time < before.time:
            yield _invalid(f"point {index} is at {after.time:g} s, before the point in front of it")


def _fields(goal: TrajectoryGoal) -> Iterator[TrajectoryRefusal]:
    for name in ("velocities", "accelerations"):
        lacking = [index for index, point in enumerate(goal.points) if not getattr(point, name)]
        if lacking and len(lacking) < len(goal.points):
            yield _invalid(f"point {lacking[0]} has no {name}, but others have")
    first, last = goal.points[0], goal.points[-1]
    if first.accelerations and not first.velocities:
        yield _invalid("it has accelerations without velocities")
    for joint, velocity in zip(goal.joints, last.velocities, strict=False):
        if velocity:
            yield _invalid(f"joint '{joint}' has a velocity of {velocity:g} at the end, not 0", joint)


def _invalid(message: str, joint: str = "") -> TrajectoryRefusal:
    return TrajectoryRefusal(TrajectoryCode.INVALID_GOAL, message, joint)


ROUNDING = 1e-9  # a smaller excess over a limit, relative or in [rad, m], counts as none
BRIEFEST = 1e-3  # [s], the least time to a point
LONGEST = 1e6  # [s], a motion that needs more is impossible
FADES = 0.05  # share of its speed with which a joint catches up, which planners leave
USUAL_SPEED = 1.0  # [rad/s or m/s] of a joint without a limit

Kind = Literal["straight", "spline", "cubic", "quintic"]


@dataclass(frozen=True, slots=True)
class TrajectoryPlan:
    """What to follow from `begin` on: a curve for each joint, all of the same duration."""

    begin: float
    curves: Mapping[str, Curve]
    notes: tuple[str, ...] = ()
    """Sentences on what was dropped, clamped or stretched."""

    @property
    def end(self) -> float:
        """When the joints should have arrived [s]."""
        return self.begin + max(curve.duration for curve in self.curves.values())


@dataclass(frozen=True, slots=True)
class JointRules:
    """What a joint permits."""

    limits: MotionLimits
    is_continuous: bool = False
    """It turns without end: a position stands for all that differ from it by whole turns."""


class _Unfit(Exception):  # noqa: N818 - it is an answer, not an error
    """A trajectory cannot be followed."""

    def __init__(self, message: str, joint: str = "", code: TrajectoryCode = TrajectoryCode.INVALID_GOAL) -> None:
        super().__init__(message)
        self.refusal = TrajectoryRefusal(code, message, joint)


def begin_of(goal: TrajectoryGoal, now: float) -> float:
    """Return when the trajectory takes over [s]."""
    return max(now, goal.start)


def plan_trajectory(
    goal: TrajectoryGoal,
    now: float,
    start: Mapping[str, JointSample],
    joints: Mapping[str, JointRules],
    policy: TrajectoryPolicy,
) -> TrajectoryPlan | TrajectoryRefusal:
    """Return the curves from `start`, the state of the joints at `begin_of(goal, now)`, or why there are none.

    They keep the limits of position and velocity. Accelerations that a goal demands are left to the limiter of each
    joint, and to the tolerance of its path.
    """
    mistake = mistake_in(goal, joints)
    if mistake is not None:
        return mistake
    draft = _Draft(goal, start, joints, policy)
    try:
        draft.drop_past_points(begin_of(goal, now) - (goal.start or begin_of(goal, now)))
        draft.place()
        draft.keep_in_range()
        draft.make_way_to_first_point()
        curves = {name: draft.in_range(name, curve) for name, curve in draft.curves_within_speed().items()}
        return TrajectoryPlan(begin_of(goal, now), curves, tuple(draft.notes))
    except _Unfit as unfit:
        return unfit.refusal


class _Draft:
    """A trajectory on its way to curves: `times` of the points, and the samples of each joint at them."""

    def __init__(
        self,
        goal: TrajectoryGoal,
        start: Mapping[str, JointSample],
        joints: Mapping[str, JointRules],
        policy: TrajectoryPolicy,
    ) -> None:
        self.joints = {name: joints[name] for name in goal.joints}
        self.start, self.policy = start, policy
        self.notes: list[str] = []
        self.kind: Kind = "straight" if policy.interpolation == "linear" else "spline"
        if goal.points[0].velocities:
            self.kind = "quintic" if goal.points[0].accelerations else "cubic"
        self.times = [point.time for point in goal.points]
        self.tracks = {name: [_sample(point, i) for point in goal.points] for i, name in enumerate(goal.joints)}
        self._as_given: tuple[list[float], dict[str, list[JointSample]]] | None = None  # before small gaps faded out

    def drop_past_points(self, elapsed: float) -> None:
        """Leave out what should have been reached `elapsed` [s] after the start."""
        if elapsed <= 0.0:
            return
        past = sum(time <= elapsed for time in self.times)
        if past == len(self.times):
            raise _Unfit(f"all points are past, the last by {elapsed - self.times[-1]:.3f} s", code=_OLD)
        if past:
            self.notes.append(f"{past} of {len(self.times)} points are past, and dropped")
        self._drop(past)
        self.times = [time - elapsed for time in self.times]

    def place(self) -> None:
        """Take the turn nearest to the start for joints that turn without end."""
        for name, rules in self.joints.items():
            if rules.is_continuous:
                turns = round((self.start[name].position - self.tracks[name][0].position) / math.tau) * math.tau
                self.tracks[name] = [replace(sample, position=sample.position + turns) for sample in self.tracks[name]]

    def keep_in_range(self) -> None:
        """Clamp or refuse points outside of the limits."""
        for name, rules in self.joints.items():
            for index, sample in enumerate(self.tracks[name]):
                inside = rules.limits.clamped(sample.position)
                if abs(inside - sample.position) > ROUNDING:
                    self._refuse_unless_clamped(f"joint '{name}' at {sample.position:g} is outside of its limits", name)
                    self.notes.append(f"joint '{name}' is clamped from {sample.position:g} to {inside:g}")
                self.tracks[name][index] = replace(sample, position=inside)

    def make_way_to_first_point(self) -> None:
        """Give a first point at 0 s the time that the limits demand; all others are later by that.

        No time is needed by joints that are within their tolerance of it: the gap fades out during the motion.
        """
        if self.times[0] > 0.0:
            return
        gaps = {name: self.start[name].position - track[0].position for name, track in self.tracks.items()}
        widest = max(map(abs, gaps.values()))
        if len(self.times) == 1 or widest > max(self.policy.tolerance.goal or 0.0, ROUNDING):
            self._go_to_first_point()
            return
        if widest > ROUNDING:
            self._as_given = self.times, self.tracks
            self.tracks = {name: self._faded(name, gap) for name, gap in gaps.items()}
        self._drop(1)

    def _faded(self, name: str, gap: float) -> list[JointSample]:
        """Return the samples of a joint that begins a gap [rad or m] away from the first one."""
        speed = FADES * (self.joints[name].limits.velocity or USUAL_SPEED)
        whole = min(max(1.5 * abs(gap) / speed, BRIEFEST), self.times[-1])
        found = []
        for time, at in zip(self.times, self.tracks[name], strict=True):
            if (s := time / whole) >= 1.0:
                break
            position = self.joints[name].limits.clamped(at.position + gap * (1 - s) ** 2 * (1 + 2 * s))
            velocity = at.velocity + 6 * gap * s * (s - 1) / whole
            found.append(JointSample(position, velocity, at.acceleration + 6 * gap * (2 * s - 1) / whole**2))
        return [*found, *self.tracks[name][len(found) :]]

    def _go_to_first_point(self) -> None:
        needed = self._least_time()
        self.notes.append(f"the point at 0 s is reached as fast as the limits allow, after {needed:.3f} s")
        self.times = [time + needed for time in self.times]

    def curves_within_speed(self) -> dict[str, Curve]:
        """Return the curves, stretched in time if they were too fast and the policy permits it."""
        total = 1.0
        for _ in range(30):  # the velocity at the start stays, so that one stretch need not suffice
            curves = {name: self._curve(name) for name in self.joints}
            excesses = {name: _excess(curves[name], rules.limits) for name, rules in self.joints.items()}
            name, excess = max(excesses.items(), key=itemgetter(1))
            if excess <= 1.0 + ROUNDING:
                if total > 1.0:
                    self.notes.append(f"it takes {total:.2f} times as long, to keep to the limits of velocity")
                return curves
            if self._as_given is not None:
                (self.times, self.tracks), self._as_given = self._as_given, None
                self._go_to_first_point()
                continue
            if self.policy.too_fast == "refuse" or math.isinf(excess):
                break
            self._stretch(excess)
            total *= excess
        limits = self.joints[name].limits
        raise _Unfit(f"joint '{name}' would move at {curves[name].speed:.3g}, its limit is {limits.speed:.3g}", name)

    def in_range(self, name: str, curve: Curve) -> Curve:
        """Return the curve of a joint; if it leaves the range between its points it is calmed, clamped or refused."""
        limits = self.joints[name].limits
        if _is_within(curve, limits):
            return curve
        if self.kind == "spline":
            calm = self._curve(name, is_calm=True)
            if _is_within(calm, limits) and _excess(calm, limits) <= 1.0 + ROUNDING:
                self.notes.append(f"joint '{name}' has a less smooth curve, which stays within its limits")
                return calm
        low, high = curve.extent
        self._refuse_unless_clamped(f"joint '{name}' would move from {low:.4g} to {high:.4g}, outside its limits", name)
        self.notes.append(f"joint '{name}' is clamped to its limits between points")
        return curve.clamped(min(limits.least, curve.first), max(limits.greatest, curve.first))

    def _curve(self, name: str, *, is_calm: bool = False) -> Curve:
        samples = [self.start[name], *self.tracks[name]]
        times, positions = [0.0, *self.times], [sample.position for sample in samples]
        velocities = [sample.velocity for sample in samples]
        match self.kind:
            case "straight":
                return straight(times, positions)
            case "quintic":
                return quintic(times, samples)
            case "spline":
                velocities = spline_velocities(times, positions, velocities[0], 0.0)
                if is_calm:
                    velocities = calmed_velocities(times, positions, velocities)
        return cubic(times, positions, velocities)

    def _stretch(self, factor: float) -> None:
        self.times = [time * factor for time in self.times]
        self.tracks = {
            name: [
                JointSample(sample.position, sample.velocity / factor, sample.acceleration / (factor * factor))
                for sample in track
            ]
            for name, track in self.tracks.items()
        }

    def _least_time(self) -> float:
        """Return a time in which all joints can reach their first points.

        What one joint can do in a time, it need not be able to do in a longer one: on the way to a near point, a joint
        that moves has to brake harder if it has time to overshoot. So all joints are tried together.
        """
        for name, rules in self.joints.items():
            is_there = self.tracks[name][0].position == self.start[name].position
            if rules.limits.velocity is None and rules.limits.acceleration is None and not is_there:
                raise _Unfit(f"joint '{name}' has no limits that say how fast it can reach a point at 0 s", name)
        upper = BRIEFEST
        while (late := self._too_slow(upper)) is not None:
            upper *= 2
            if upper > LONGEST:
                raise _Unfit(f"joint '{late}' cannot reach the point at 0 s within its limits", late)
        lower = upper / 2 if upper > BRIEFEST else upper
        for _ in range(30):
            middle = (lower + upper) / 2
            lower, upper = (lower, middle) if self._too_slow(middle) is None else (middle, upper)
        return upper

    def _too_slow(self, time: float) -> str | None:
        """Return a joint that cannot reach its first point in this time [s], None if all can."""
        is_straight = self.kind == "straight"
        return next(
            (
                name
                for name, rules in self.joints.items()
                if not _is_possible(self.start[name], self.tracks[name][0], time, rules.limits, is_straight=is_straight)
            ),
            None,
        )

    def _refuse_unless_clamped(self, message: str, joint: str) -> None:
        if self.policy.outside == "refuse":
            raise _Unfit(message, joint)

    def _drop(self, count: int) -> None:
        self.times = self.times[count:]
        self.tracks = {name: track[count:] for name, track in self.tracks.items()}


_OLD = TrajectoryCode.OLD_HEADER_TIMESTAMP


def _sample(point: TrajectoryPoint, index: int) -> JointSample:
    velocity = point.velocities[index] if point.velocities else 0.0
    return JointSample(point.positions[index], velocity, point.accelerations[index] if point.accelerations else 0.0)


def _is_within(curve: Curve, limits: MotionLimits) -> bool:
    """Return whether a curve stays in range; a joint that begins outside may be there, but no farther."""
    low, high = curve.extent
    return low >= min(limits.least, curve.first) - ROUNDING and high <= max(limits.greatest, curve.first) + ROUNDING


def _excess(curve: Curve, limits: MotionLimits) -> float:
    """Return how many times too fast a curve is."""
    if not curve.speed or limits.velocity is None:
        return 0.0
    return curve.speed / limits.velocity if limits.velocity else math.inf


def _is_possible(start: JointSample, end: JointSample, time: float, limits: MotionLimits, *, is_straight: bool) -> bool:
    """Return whether a joint can get from start to end in this time."""
    if is_straight:
        return abs(end.position - start.position) <= limits.speed * time * (1.0 + ROUNDING)
    times, positions = (0.0, time), (start.position, end.position)
    curve = cubic(times, positions, (start.velocity, end.velocity))
    hardest = max(abs(curve.sample(0.0).acceleration), abs(curve.pieces[0][2] * 2 + curve.pieces[0][3] * 6 * time))
    return _excess(curve, limits) <= 1.0 + ROUNDING and hardest <= (limits.acceleration or math.inf)
