"""What a joint trajectory is, and what is wrong with one before it moves anything. All times are robot time [s]."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import field
from enum import IntEnum
from typing import Literal

from rbxcompose.dataclass import dataclass


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
    allow_partial: bool = True
    """Whether a goal may leave out joints; they hold."""
    allow_final_velocity: bool = False
    """Whether the last point may be passed with a velocity."""
    start_from: Literal["commanded", "measured"] = "commanded"
    """Where a trajectory starts when none is running."""
    tolerance: TrajectoryTolerance = TrajectoryTolerance()
    tolerances: Mapping[str, TrajectoryTolerance] = field(default_factory=dict)
    """Of single joints, in place of `tolerance`."""
    goal_time: float = 1.0
    """How long after its end the joints may take to arrive [s]; inf waits for ever."""


@dataclass(frozen=True, slots=True)
class TrajectoryRefusal:
    """Why a trajectory is not followed."""

    code: TrajectoryCode
    message: str
    joint: str = ""


def mistake_in(goal: TrajectoryGoal, known: Collection[str], policy: TrajectoryPolicy) -> TrajectoryRefusal | None:
    """Return what is wrong with the goal, whatever the limits and the state of the `known` joints are."""
    return next(itertools.chain(_joints(goal, known, policy), _shapes(goal), _times(goal), _fields(goal, policy)), None)


def _joints(goal: TrajectoryGoal, known: Collection[str], policy: TrajectoryPolicy) -> Iterator[TrajectoryRefusal]:
    twice = next((name for name, count in Counter(goal.joints).items() if count > 1), None)
    unknown = next((name for name in goal.joints if name not in known), None)
    missing = next((name for name in known if name not in goal.joints), None)
    code = TrajectoryCode.INVALID_JOINTS
    if not goal.joints:
        yield TrajectoryRefusal(code, "it names no joints")
    if twice is not None:
        yield TrajectoryRefusal(code, f"joint '{twice}' is named twice", twice)
    if unknown is not None:
        yield TrajectoryRefusal(code, f"joint '{unknown}' is unknown; there are {', '.join(known)}", unknown)
    if missing is not None and not policy.allow_partial:
        yield TrajectoryRefusal(code, f"joint '{missing}' is missing", missing)


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


def _fields(goal: TrajectoryGoal, policy: TrajectoryPolicy) -> Iterator[TrajectoryRefusal]:
    for name in ("velocities", "accelerations"):
        lacking = [index for index, point in enumerate(goal.points) if not getattr(point, name)]
        if lacking and len(lacking) < len(goal.points):
            yield _invalid(f"point {lacking[0]} has no {name}, but others have")
    first, last = goal.points[0], goal.points[-1]
    if first.accelerations and not first.velocities:
        yield _invalid("it has accelerations without velocities")
    for joint, velocity in zip(goal.joints, last.velocities, strict=False):
        if velocity and not policy.allow_final_velocity:
            yield _invalid(f"joint '{joint}' has a velocity of {velocity:g} at the end, not 0", joint)


def _invalid(message: str, joint: str = "") -> TrajectoryRefusal:
    return TrajectoryRefusal(TrajectoryCode.INVALID_GOAL, message, joint)
