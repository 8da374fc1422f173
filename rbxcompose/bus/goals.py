"""Pure core of an action server: its goals and their states, as ROS 2 defines them."""

from collections.abc import Iterator
from enum import IntEnum
from typing import Generic, TypeVar

from rbxcompose.base.dataclass import dataclass

G = TypeVar("G")
R = TypeVar("R")

KEPT_FOR = 10.0  # [s] after its end in which the result of a goal can be requested
MOST_KEPT = 100  # ended goals

ANY_GOAL = bytes(16)  # the goal id that means no particular goal


class GoalState(IntEnum):
    """The states of `action_msgs/GoalStatus`."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def is_end(self) -> bool:
        """Return whether a goal stays in this state."""
        return self >= GoalState.SUCCEEDED


class CancelCode(IntEnum):
    """The return codes of `action_msgs/CancelGoal`."""

    NONE = 0
    REJECTED = 1
    UNKNOWN_GOAL = 2
    GOAL_TERMINATED = 3


@dataclass(slots=True, eq=False)
class Goal(Generic[G, R]):
    """A goal that was accepted."""

    id: bytes  # 16 bytes
    request: G
    client: bytes  # GID of the sender
    accepted: int  # [ns]
    state: GoalState = GoalState.EXECUTING
    result: R | None = None
    ended: float = 0.0  # [s] of robot time


class Goals(Generic[G, R]):
    """The goals of one action: one is carried out at a time; ended goals are remembered for a while."""

    def __init__(self) -> None:
        self.current: Goal[G, R] | None = None  # the one that has not ended
        self._goals: dict[bytes, Goal[G, R]] = {}

    def __iter__(self) -> Iterator[Goal[G, R]]:
        return iter(self._goals.values())

    def find(self, id: bytes) -> Goal[G, R] | None:
        """Return the goal with that id, if it is still remembered."""
        return self._goals.get(id)

    def accept(self, goal: Goal[G, R]) -> None:
        """Accept a goal; the current one must have ended, and the id must be new."""
        if self.current is not None or goal.id in self._goals:
            raise ValueError("a goal can be accepted only after the current one has ended, and only once")
        self._goals[goal.id] = self.current = goal

    def end(self, goal: Goal[G, R], state: GoalState, result: R, now: float) -> bool:
        """End a goal at `now` [s]; return False if it had already ended."""
        if goal is not self.current:
            return False
        goal.state, goal.result, goal.ended = state, result, now
        self.current = None
        return True

    def cancel(self, id: bytes = ANY_GOAL, stamp: int = 0) -> tuple[CancelCode, list[Goal[G, R]]]:
        """Request the cancellation of goals and return those that will be cancelled.

        `id` names one goal, `stamp` [ns] all that were accepted until then; with neither it is all goals.
        """
        named = self.find(id)
        if id != ANY_GOAL and not stamp and named is None:
            return CancelCode.UNKNOWN_GOAL, []
        if id != ANY_GOAL and not stamp and named is not self.current:
            return CancelCode.GOAL_TERMINATED, []
        goal = self.current
        is_old = goal is not None and stamp > 0 and goal.accepted <= stamp
        if goal is None or not (goal is named or is_old or (id == ANY_GOAL and not stamp)):
            return CancelCode.NONE, []
        goal.state = GoalState.CANCELING
        return CancelCode.NONE, [goal]

    def cancel_from(self, client: bytes) -> bool:
        """Request the cancellation of the goal of a client that is gone; return whether it has one."""
        if self.current is None or self.current.client != client:
            return False
        self.current.state = GoalState.CANCELING
        return True

    def forget(self, now: float) -> None:
        """Drop ended goals that no client will query again."""
        ended = [goal for goal in self if goal is not self.current]  # in the order in which they ended
        for place, goal in enumerate(reversed(ended)):
            if place >= MOST_KEPT or goal.ended < now - KEPT_FOR:
                del self._goals[goal.id]
