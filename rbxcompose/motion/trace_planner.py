"""From points of the tip to a trajectory along straight lines and arcs between them, verified like any other."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.inverse_kinematics import ANGLE_TOLERANCE, TOLERANCE, PoseTarget
from rbxcompose.motion.jerk_limits import jerks_of
from rbxcompose.motion.parametrisation import MARGIN, Trajectory, speeds_of, timed
from rbxcompose.motion.planner import FINE, MotionPlan, MotionPlanner, Planning, mistake_in_start
from rbxcompose.motion.reasons import MotionFailure, MotionReason
from rbxcompose.motion.recheck import examined
from rbxcompose.motion.tip_path import TipStretch, WayPoint, WrongWayError, shifted, stretches
from rbxcompose.motion.tip_trace import STEP, Traced, strayed, traced

Array = NDArray[np.float64]

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
        for one in self.points:
            if self.relative:
                pose = shifted(start, frame, one.pose.translation, one.pose.rotation)
            else:
                pose = frame.compose(one.pose)
            if self.keep_orientation:
                pose = replace(pose, rotation=start.rotation)
            found.append(WayPoint(pose, one.is_via))
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
                points = np.concatenate([one.values for one in parts])
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
                if self._is_late():
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
        share = sum(float(one.lengths[-1]) for one in parts) / self._total
        if problem and (share < self._wish.least or not parts):
            return MotionFailure(MotionReason.PATH_INCOMPLETE, f"only {share:.1%} of the way: {problem}", share)
        return parts, share if problem else 1.0

    def _is_late(self) -> bool:
        return self._planner.now() - self._began >= self._planner.settings.time or self._steps >= MOST_STEPS

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
    for one in parts[1:]:
        times.append(one.times[1:] + ends)
        ends += one.duration
    rest = parts[1:]
    return Trajectory(
        np.concatenate(times),
        np.concatenate([parts[0].positions, *(one.positions[1:] for one in rest)]),
        np.concatenate([parts[0].velocities, *(one.velocities[1:] for one in rest)]),
    )
