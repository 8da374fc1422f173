"""Follows joint trajectories, judges whether the joints do, and decides which goal leads."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field
from typing import Any, Protocol

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import wrap_angle
from rbxcompose.domains.servos.curves import Curve, JointSample, braking
from rbxcompose.domains.servos.trajectory import (
    JointRules,
    TrajectoryCode,
    TrajectoryGoal,
    TrajectoryPlan,
    TrajectoryPoint,
    TrajectoryPolicy,
    TrajectoryRefusal,
    TrajectoryTolerance,
    begin_of,
    plan_trajectory,
)
from rbxcompose.msgs.rbxcompose_msgs import MoveJoints
from rbxcompose.msgs.stamps import to_seconds

FASTEST = 5.0  # [1/s], at which the share changes where no joint is in a hurry
SPARE = 0.1  # of the acceleration of a joint, by which a change may exceed it, so that it is always possible

Demand = tuple[JointSample, float | None]
"""Where a joint is at full speed, and its greatest acceleration."""


class TrajectoryPace:
    """From robot time to the time of one trajectory at a time, both [s]."""

    def __init__(self) -> None:
        self.share = 1.0
        """What is wanted, from 0 to 1."""
        self.begin(0.0, is_at_rest=True)

    def begin(self, now: float, *, is_at_rest: bool) -> None:
        """Let a trajectory begin; joints that move go on as fast as they do, and change their pace from there."""
        self._rate, self._change = self.share if is_at_rest else 1.0, 0.0
        self._late, self._passed = 0.0, now

    def time(self, now: float) -> float:
        """Return the robot time at which a trajectory that nobody slows down would be where this one is."""
        return now - self._late - (1.0 - self._rate) * max(0.0, now - self._passed)

    def scaled(self, sample: JointSample) -> JointSample:
        """Return what a sample at full speed is at the present one."""
        acceleration = sample.acceleration * self._rate**2 + sample.velocity * self._change
        return JointSample(sample.position, sample.velocity * self._rate, acceleration)

    def advance(self, now: float, demands: Iterable[Demand]) -> None:
        """Let time pass, and change the pace towards what is wanted, as `demands` allow from now on."""
        self._late, dt, self._passed = now - self.time(now), now - self._passed, max(now, self._passed)
        missing = self.share - self._rate
        if dt <= 0.0 or missing == 0.0:
            self._change = 0.0
            return
        low, high = -FASTEST, FASTEST
        for sample, most in demands:
            if most is not None and sample.velocity:
                hard = sample.acceleration * self._rate**2
                room = max(most, abs(hard)) + SPARE * most
                ends = sorted(((-room - hard) / sample.velocity, (room - hard) / sample.velocity))
                low, high = max(low, ends[0]), min(high, ends[1])
        self._change = min(high, max(low, missing / dt))
        self._rate = self.share if self._change == missing / dt else self._rate + self._change * dt

    def arrive(self, now: float, end: float) -> None:
        """Let time pass as ever from the end of the trajectory on."""
        self._late, self._rate, self._change, self._passed = now - end, 1.0, 0.0, now


def share_mistake(share: float) -> str:
    """Return why a share is none; nothing if it is one."""
    return "" if math.isfinite(share) and 0.0 <= share <= 1.0 else "a speed is from 0 % to 100 % of that of the goal"


Samples = Mapping[str, JointSample]
AT_REST = 0.01  # [rad/s or m/s] at the beginning of a trajectory, below which it may begin at any pace


@dataclass(frozen=True, slots=True)
class TrajectoryOutcome:
    """How a trajectory ended."""

    code: TrajectoryCode
    message: str


@dataclass(frozen=True, slots=True)
class FollowStep:
    """What a cycle asks for."""

    desired: Mapping[str, JointSample] = field(default_factory=dict)
    """Of joints that are led now; any other holds."""
    outcome: TrajectoryOutcome | None = None
    """In the cycle in which the trajectory ends."""


@dataclass(frozen=True, slots=True)
class _Motion:
    """A curve on its way."""

    begin: float
    curve: Curve

    def at(self, now: float) -> JointSample:
        return self.curve.sample(now - self.begin)

    def is_over(self, now: float) -> bool:
        return now - self.begin >= self.curve.duration


@dataclass(frozen=True, slots=True)
class _Run:
    """A goal that was accepted."""

    goal: TrajectoryGoal
    plan: TrajectoryPlan
    is_live: bool = False
    """Whether it passes at its own speed, whatever people want of others."""


class TrajectoryFollower:
    """Leads joints along one trajectory at a time.

    However a trajectory ends before its time, its joints decelerate within their limits and hold. All times are robot
    time [s].
    """

    def __init__(self, joints: Mapping[str, JointRules], policy: TrajectoryPolicy) -> None:
        self.joints = dict(joints)
        self.policy = policy
        self.pace = TrajectoryPace()
        """At which share of its own speed a trajectory passes."""
        self._motions: dict[str, _Motion] = {}  # of joints that are led
        self._run: _Run | None = None
        self._next: _Run | None = None  # replaces the other at its beginning

    @property
    def is_following(self) -> bool:
        """Return whether a trajectory runs, or waits for its start."""
        return self._run is not None or self._next is not None

    @property
    def is_moving(self) -> bool:
        """Return whether joints are led: along a trajectory, or to rest."""
        return bool(self._motions)

    def accept(
        self, goal: TrajectoryGoal, now: float, commanded: Samples, *, is_live: bool = False
    ) -> TrajectoryPlan | TrajectoryRefusal:
        """Take over a goal, from now on or from its start on; return its plan, or why it is refused.

        It replaces what runs, whose joints it continues with position, velocity and acceleration; outcomes are its own
        from now on. Joints which it leaves out come to rest when it begins. A refusal changes nothing. `commanded` has
        all joints of the goal that are known; those that nothing leads start from there. What `is_live` passes at its
        own speed.
        """
        begin = begin_of(goal, now)
        names = [name for name in goal.joints if name in self.joints]
        lost = next((name for name in names if name not in self._motions and not commanded[name].is_finite), None)
        if lost is not None:
            return TrajectoryRefusal(TrajectoryCode.INVALID_GOAL, f"it is not known where joint '{lost}' is", lost)
        waiting = {name: self._motions.get(name) or self._resting(name, commanded[name], now) for name in names}
        is_led = {name: name in self._motions or begin > now for name in names}
        there = {name: self._sample(name, begin) for name in names if name in self._motions}
        start = {
            name: there.get(name) or (waiting[name].at(begin) if is_led[name] else commanded[name]) for name in names
        }
        plan = plan_trajectory(goal, now, start, self.joints, self.policy)
        if isinstance(plan, TrajectoryPlan):
            self._motions |= waiting
            self._next = _Run(goal, plan, is_live)
            self._switch(now)
        return plan

    def step(self, now: float, measured: Samples, commanded: Samples) -> FollowStep:
        """Return what is desired at `now`. `measured` and `commanded` have all joints of the trajectory."""
        self._switch(now)
        self._pass(now)
        desired = {name: self._sample(name, now) for name in self._motions}
        outcome = self._judged(now, desired, measured, commanded) if self._run is not None else None
        if outcome is not None:
            self._end(now)
        elif not self.is_following:
            self._motions = {name: motion for name, motion in self._motions.items() if not motion.is_over(now)}
        return FollowStep(desired, outcome)

    def cancel(self, now: float) -> TrajectoryOutcome | None:
        """Bring the joints to rest on demand; return the outcome, None if no trajectory runs."""
        return self._stop(now, TrajectoryOutcome(TrajectoryCode.SUCCESSFUL, "canceled"))

    def abort(self, now: float, reason: str) -> TrajectoryOutcome | None:
        """Bring the joints to rest since one, or something else, has failed; return the outcome as `cancel` does."""
        return self._stop(now, TrajectoryOutcome(TrajectoryCode.PATH_TOLERANCE_VIOLATED, reason))

    def lose(self, joint: str, now: float, reason: str) -> TrajectoryOutcome | None:
        """Stop leading a joint at once, for it has no torque any more; return the outcome if that ends a trajectory."""
        runs = [run for run in (self._run, self._next) if run is not None and joint in run.plan.curves]
        outcome = self.abort(now, reason) if runs else None
        self._motions.pop(joint, None)
        return outcome

    def _stop(self, now: float, outcome: TrajectoryOutcome) -> TrajectoryOutcome | None:
        if not self.is_following:
            return None
        self._end(now)
        return outcome

    def _end(self, now: float) -> None:
        self._motions = {name: self._brake(name, now) for name in self._motions}
        self._run = self._next = None

    def _is_paced(self, name: str) -> bool:
        """Return whether a joint is on a trajectory that people may slow down."""
        return self._run is not None and not self._run.is_live and name in self._run.plan.curves

    def _sample(self, name: str, now: float) -> JointSample:
        if not self._is_paced(name):
            return self._motions[name].at(now)
        return self.pace.scaled(self._motions[name].at(self.pace.time(now)))

    def _pass(self, now: float) -> None:
        """Let time pass for the trajectory; its pace stays while another one waits to continue it."""
        run = self._run
        if run is None or run.is_live or self._next is not None:
            return
        time = self.pace.time(now)
        if time >= run.plan.end:
            self.pace.arrive(now, max(run.plan.end, time))
            return
        curves = {name: motion.at(time) for name, motion in self._motions.items() if self._is_paced(name)}
        self.pace.advance(now, [(curve, self.joints[name].limits.acceleration) for name, curve in curves.items()])

    def _switch(self, now: float) -> None:
        """Let the waiting trajectory begin when its time has come."""
        run = self._next
        if run is None or now < run.plan.begin:
            return
        begin, curves = run.plan.begin, run.plan.curves
        left = {name: self._brake(name, begin) for name in self._motions if name not in curves}
        is_at_rest = all(abs(curve.sample(0.0).velocity) < AT_REST for curve in curves.values())
        self._motions = left | {name: _Motion(begin, curve) for name, curve in curves.items()}
        self._run, self._next = run, None
        self.pace.begin(begin, is_at_rest=is_at_rest)

    def _brake(self, name: str, now: float) -> _Motion:
        return self._resting(name, self._sample(name, now), now)

    def _resting(self, name: str, sample: JointSample, now: float) -> _Motion:
        limits = self.joints[name].limits
        return _Motion(now, braking(sample, limits.acceleration, limits.least, limits.greatest))

    def _judged(self, now: float, desired: Samples, measured: Samples, commanded: Samples) -> TrajectoryOutcome | None:
        run = self._run
        if run is None:
            return None
        end = run.plan.end if run.is_live else run.plan.end + now - self.pace.time(now)
        if now < end or self._next is not None:
            return self._path_violation(run, desired, measured)
        open_ = self._not_arrived(run, desired, measured, commanded)
        allowed = self.policy.goal_time if run.goal.goal_time is None else run.goal.goal_time
        if open_ is None:
            return TrajectoryOutcome(TrajectoryCode.SUCCESSFUL, "arrived")
        return open_ if now > end + allowed else None

    def _path_violation(self, run: _Run, desired: Samples, measured: Samples) -> TrajectoryOutcome | None:
        for name in run.plan.curves:
            tolerance = self._tolerance(run, name).path
            error = self._error(name, desired[name], measured[name])
            if tolerance is not None and not abs(error) <= tolerance:
                message = f"joint '{name}' is {abs(error):.3g} from its path, more than {tolerance:.3g}"
                return TrajectoryOutcome(TrajectoryCode.PATH_TOLERANCE_VIOLATED, message)
        return None

    def _not_arrived(
        self, run: _Run, desired: Samples, measured: Samples, commanded: Samples
    ) -> TrajectoryOutcome | None:
        """Return how it fails if it ends now; None if all joints have arrived."""
        for name in run.plan.curves:
            tolerance = self._tolerance(run, name)
            checks = (
                ("from its goal", self._error(name, desired[name], measured[name]), tolerance.goal),
                ("from its goal by its command", self._error(name, desired[name], commanded[name]), tolerance.goal),
                ("per second fast at its goal", measured[name].velocity, tolerance.velocity),
            )
            for words, error, limit in checks:
                if limit is not None and not abs(error) <= limit:
                    message = f"joint '{name}' is {abs(error):.3g} {words}, more than {limit:.3g}"
                    return TrajectoryOutcome(TrajectoryCode.GOAL_TOLERANCE_VIOLATED, message)
        return None

    def _tolerance(self, run: _Run, joint: str) -> TrajectoryTolerance:
        return run.goal.tolerances.get(joint, self.policy.tolerance)

    def _error(self, joint: str, desired: JointSample, actual: JointSample) -> float:
        error = desired.position - actual.position
        return wrap_angle(error) if self.joints[joint].is_continuous and math.isfinite(error) else error


Accept = Callable[[TrajectoryGoal], TrajectoryPlan | TrajectoryRefusal]


class GoalServer(Protocol):
    """The server of an action, with its goal (`sdk.bound.ServedGoal`) or None."""

    @property
    def current(self) -> Any:
        """Return the goal to carry out; a newer one of the same action replaces it."""


@dataclass(frozen=True, slots=True)
class TrajectoryWay:
    """An action that leads joints: its server, what its goals ask for, and how it reports an end."""

    server: GoalServer
    trajectory: Callable[[Any], TrajectoryGoal]
    result: Callable[[TrajectoryCode, str], object]


class TrajectoryGoals:
    """The goals of the actions of one controller, of which the newest leads its joints."""

    def __init__(self, follower: TrajectoryFollower, ways: Mapping[str, TrajectoryWay]) -> None:
        """Take the actions by their names."""
        self._follower, self._ways = follower, ways
        self._led: Any = None  # the goal that leads, or led until another replaced it
        self._way = ""

    def replace(self, way: str) -> None:
        """End the goal that is there, since this action accepts another."""
        reason = f"replaced by a newer goal of '{way}'"
        for other in self._ways.values():
            goal = other.server.current
            if goal is None:
                continue
            if goal.cancel_requested:
                goal.canceled(other.result(TrajectoryCode.SUCCESSFUL, "canceled"))
            else:
                goal.aborted(reason, other.result(TrajectoryCode.INVALID_GOAL, reason))

    def take(self, now: float, accept: Accept) -> None:
        """Take over a new goal or a cancellation.

        If a goal is refused, the joints come to rest: what led them before has ended with its arrival.
        """
        for name, way in self._ways.items():
            goal = way.server.current
            if goal is None:
                continue
            if goal.cancel_requested:
                self._leave(now)
                goal.canceled(way.result(TrajectoryCode.SUCCESSFUL, "canceled"))
            elif goal is not self._led:
                answer = accept(way.trajectory(goal.request))
                self._led, self._way = goal, name
                if isinstance(answer, TrajectoryRefusal):
                    self._leave(now)
                    goal.aborted(answer.message, way.result(answer.code, answer.message))

    def end(self, outcome: TrajectoryOutcome) -> None:
        """End the goal that leads as its trajectory ended."""
        goal, self._led = self._led, None
        if goal is None or goal is not self._ways[self._way].server.current:
            return  # another has replaced it
        result = self._ways[self._way].result(outcome.code, outcome.message)
        if outcome.code is TrajectoryCode.SUCCESSFUL:
            goal.succeeded(result)
        else:
            goal.aborted(outcome.message, result)

    def _leave(self, now: float) -> None:
        self._led = None
        self._follower.cancel(now)


def move_way(server: GoalServer) -> TrajectoryWay:
    """Return the action that moves some joints to positions."""
    return TrajectoryWay(server, trajectory_of_move, lambda code, message: MoveJoints.Result(message=message))


def trajectory_of_move(goal: MoveJoints.Goal) -> TrajectoryGoal:
    """Return a move as a trajectory of one point."""
    return TrajectoryGoal(goal.joints, (TrajectoryPoint(to_seconds(goal.duration), tuple(goal.positions.tolist())),))
