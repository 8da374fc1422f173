"""The goals of a controller: trajectories, and single moves of joints. The newest leads, however it was asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from rbxcompose.control.trajectory import TrajectoryCode, TrajectoryGoal, TrajectoryPoint, TrajectoryRefusal
from rbxcompose.control.trajectory_follower import TrajectoryFollower, TrajectoryOutcome
from rbxcompose.control.trajectory_plan import TrajectoryPlan
from rbxcompose.dataclass import dataclass
from rbxcompose.msgs.rbxcompose_msgs import MoveJoints
from rbxcompose.msgs.stamps import to_seconds

Accept = Callable[[TrajectoryGoal], TrajectoryPlan | TrajectoryRefusal]


class GoalServer(Protocol):
    """The server of an action, with its goal (`sdk.bound.ServedGoal`) or None."""

    @property
    def current(self) -> Any:
        """Return the goal to carry out; a newer one of the same action replaces it."""
        ...


@dataclass(frozen=True, slots=True)
class TrajectoryWay:
    """An action that leads joints: its server, what its goals ask for, and how it tells an end."""

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
