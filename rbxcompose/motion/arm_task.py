"""One goal of an arm, from the request to the end of the motion; time and messages come from its site."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import field
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.joint_space import JointSpace
from rbxcompose.motion.parametrisation import Trajectory
from rbxcompose.motion.planner import MotionPlan, MotionPlanner, MotionRequest, Planning
from rbxcompose.motion.reasons import MotionFailure, MotionReason

Array = NDArray[np.float64]

MOVED = 0.02  # [rad or m] by which a joint may be elsewhere when a motion begins than when it was planned
AT_REST = 0.05  # [rad/s or m/s]; no motion is planned for an arm that is faster
SETTLING = 3.0  # [s] that an arm may take to report itself, and to come to rest
REPLANS = 2  # times that a motion is planned again because the arm was elsewhere
SLICES = 8  # of planning in one call, so that the same goal takes the same time on a stepped clock
LONGEST_CALL = 0.2  # [s] of planning in one call, after which others may run


@dataclass(frozen=True, slots=True)
class ArmGoal:
    """What is asked for: a pose by name, positions of joints [rad or m] beside it, shares of the greatest speeds."""

    pose: str = ""
    positions: Mapping[str, float] = field(default_factory=dict)
    speed: float = 1.0
    acceleration: float = 1.0


class ArmSite(Protocol):
    """What a goal needs of the component that carries it out."""

    @property
    def now(self) -> float:
        """Return robot time [s]."""

    @property
    def measured(self) -> Mapping[str, tuple[float, float]]:
        """Return the position and velocity of each joint of the body that has reported them."""

    @property
    def poses(self) -> Mapping[str, Mapping[str, float]]:
        """Return the poses by name: positions of joints [rad or m]."""

    def place(self, positions: Mapping[str, float]) -> None:
        """Set where the joints of the rest of the body are."""

    def follow(self, names: tuple[str, ...], trajectory: Trajectory, ended: Callable[[str, bool], None]) -> None:
        """Send a trajectory to the controller; `ended` gets the reason if it failed, and whether it was cancelled."""

    def stop_following(self) -> None:
        """Ask the controller to end the trajectory; `ended` still follows."""

    def told(self, stage: str) -> None:
        """Tell in which stage it is."""

    def info(self, text: str) -> None:
        """Log an event."""


class ArmTask:
    """Plans and carries out one goal. Call `advance` until `is_over`; then `failure` is why it failed, if it did."""

    def __init__(self, site: ArmSite, planner: MotionPlanner, goal: ArmGoal) -> None:
        self.failure: MotionFailure | None = None
        self.is_over = self.is_canceled = False
        self._site, self._planner, self._goal = site, planner, goal
        self._stage: Callable[[], None] = self._settle
        self._began, self._replans = site.now, 0
        self._start = np.zeros(len(self.space.joints))

    @property
    def space(self) -> JointSpace:
        """Return the joints of the arm."""
        return self._planner.space

    def advance(self) -> None:
        """Continue."""
        if not self.is_over:
            self._stage()

    def cancel(self) -> None:
        """End it soon: planning at once, a motion as soon as the arm has come to rest."""
        if self.is_canceled or self.is_over:
            return
        self.is_canceled = True
        if self._stage == self._move:
            self._site.stop_following()
        else:
            self._end(MotionFailure(MotionReason.INTERRUPTED, "it was cancelled while it was planned"))

    def _settle(self) -> None:
        """Wait until all joints are known and at rest."""
        measured, names = self._site.measured, self.space.names
        unknown = [name for name in names if name not in measured]
        fast = [name for name in names if name in measured and abs(measured[name][1]) > AT_REST]
        if not unknown and not fast:
            self._begin_planning()
        elif self._site.now - self._began >= SETTLING:
            words = ", ".join(f"'{name}'" for name in unknown or fast)
            if unknown:
                self._fail(MotionReason.UNKNOWN_START, f"nothing has reported where {words} is")
            else:
                self._fail(MotionReason.START_MOVED, f"{words} did not come to rest within {SETTLING:g} s")

    def _begin_planning(self) -> None:
        self._start = self._where()
        request = self._request()
        if isinstance(request, MotionFailure):
            self._end(request)
            return
        others = {name: one for name, (one, _) in self._site.measured.items() if name not in self.space.names}
        self._site.place(others)
        self._stage = partial(self._continue_planning, self._planner.plan(request))
        self._site.told("planning")
        self._stage()

    def _where(self) -> Array:
        return np.array([self._site.measured[name][0] for name in self.space.names])

    def _request(self) -> MotionRequest | MotionFailure:
        """Return what is to be planned, or why it cannot be."""
        goal, poses, names = self._goal, self._site.poses, self.space.names
        if goal.pose and goal.pose not in poses:
            there = ", ".join(poses) or "none"
            return MotionFailure(
                MotionReason.UNKNOWN_GOAL, f"there is no pose '{goal.pose}'; the poses of this arm: {there}"
            )
        wanted = {**(poses[goal.pose] if goal.pose else {}), **goal.positions}
        if not wanted:
            return MotionFailure(MotionReason.UNKNOWN_GOAL, "the goal has neither a pose nor positions of joints")
        if unknown := [name for name in wanted if name not in names]:
            return MotionFailure(MotionReason.UNKNOWN_GOAL, f"'{unknown[0]}' is no joint of this arm")
        for word, share in (("speed", goal.speed), ("acceleration", goal.acceleration)):
            if not (math.isfinite(share) and 0.0 < share <= 1.0):
                return MotionFailure(MotionReason.UNKNOWN_GOAL, f"a {word} of {share:.0%} is none")
        aim = np.array([wanted.get(name, at) for name, at in zip(names, self._start.tolist(), strict=True)])
        if not all(name in wanted for name in names):  # what stays where it is may be just outside of its limits
            stays = np.array([name not in wanted for name in names])
            aim = np.where(stays, self.space.clamped(aim), aim)
        return MotionRequest(self._start, aim, goal.speed, goal.acceleration)

    def _continue_planning(self, planning: Planning) -> None:
        begin = self._site.now
        for _ in range(SLICES):
            try:
                next(planning)
            except StopIteration as ended:
                self._planned(ended.value)
                return
            if self._site.now - begin >= LONGEST_CALL:
                return

    def _planned(self, found: MotionPlan | MotionFailure) -> None:
        if isinstance(found, MotionFailure):
            self._end(found)
        elif found.trajectory is None:
            self._end(None)
        else:
            words = f"{len(found.waypoints)} points, {found.examined} positions examined, attempt {found.attempts}"
            self._set_out(found.trajectory, words)

    def _set_out(self, trajectory: Trajectory, words: str) -> None:
        """Send the trajectory, if the arm is still where it begins."""
        away = float(np.max(np.abs(self._where() - self._start)))
        if away > MOVED:
            self._replans += 1
            if self._replans > REPLANS:
                text = f"joints were up to {away:.3f} away from where the motion was planned from"
                self._fail(MotionReason.START_MOVED, text)
                return
            self._began, self._stage = self._site.now, self._settle
            return
        self._site.info(f"a motion of {trajectory.duration:.1f} s: {words}")
        self._stage = self._move
        self._site.told("moving")
        self._site.follow(self.space.names, trajectory, self._followed)

    def _move(self) -> None:
        """Wait for the controller."""

    def _followed(self, problem: str, is_canceled: bool) -> None:
        if self.is_canceled:
            self._end(MotionFailure(MotionReason.INTERRUPTED, "it was cancelled on its way"))
        elif is_canceled:
            self._fail(MotionReason.NOT_FOLLOWED, "somebody else cancelled its trajectory")
        elif problem:
            self._fail(MotionReason.NOT_FOLLOWED, problem)
        else:
            self._end(None)

    def _fail(self, reason: MotionReason, text: str) -> None:
        self._end(MotionFailure(reason, text))

    def _end(self, failure: MotionFailure | None) -> None:
        self._stage = self._move  # lets go of what was being planned
        self.is_over, self.failure = True, failure
