"""Actions of ROS 2: servers and clients, around a pure core that knows goals and their states as ROS 2 defines them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from enum import IntEnum
from itertools import count
from typing import Any, Generic, TypeVar

import xxhash

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.scheduler import ScheduledCallback
from rbxcompose.bus.local import GATE_BURST, GOALS, Allowance, Participant
from rbxcompose.bus.names import ActionNames
from rbxcompose.bus.services import Client, ServedRequest, Server, Services
from rbxcompose.bus.topics import Publisher, Subscription, Topics
from rbxcompose.bus.transport import EXPIRED
from rbxcompose.msgs.action_msgs import CancelGoal, GoalInfo, GoalStatus, GoalStatusArray
from rbxcompose.msgs.fields import require_type
from rbxcompose.msgs.stamps import to_nanoseconds, to_time
from rbxcompose.msgs.types import Action, Message
from rbxcompose.msgs.unique_identifier_msgs import UUID
from rbxcompose.sdk.bound import REASONS, Ended, Outcome, Reply
from rbxcompose.sdk.ports import ORDINARY, MessageLimits, Qos

G = TypeVar("G", bound=Message)
R = TypeVar("R", bound=Message)
F = TypeVar("F", bound=Message)

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
    cause: str = ""  # why the robot has asked it to end


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


STATUS_PERIOD = 0.1  # [s] between two publications of the goals' states during a flood of goals
LOG_PERIOD = 1.0  # [s] between two log lines during a flood of goals
LOG_BURST = 10.0  # [s]; the lines allowed in this time may also come all at once


class ServedGoal(Generic[G, R, F]):
    """A goal as its server sees it. Once it has ended, or a newer one has replaced it, its methods do nothing."""

    def __init__(self, server: ActionServer[G, R, F], goal: Goal[G, R]) -> None:
        self._server, self._goal = server, goal
        self.is_paused = False  # it is to be held in its present state

    @property
    def request(self) -> G:
        """Return the goal as it was sent."""
        return self._goal.request

    @property
    def cancel_requested(self) -> bool:
        """Return whether the goal should end soon, by `canceled`."""
        return self._goal.state is GoalState.CANCELING

    def feedback(self, message: F, /) -> None:
        """Send the client feedback."""
        self._server.publish_feedback(self._goal, message)

    def succeeded(self, result: R | None = None, /) -> None:
        """End the goal as succeeded; without a result, send its zero value."""
        self._server.end(self._goal, GoalState.SUCCEEDED, result)

    def aborted(self, reason: str = "", result: R | None = None, /) -> None:
        """End the goal as aborted and log the reason; without a result, send that in an otherwise zero one."""
        self._server.end(self._goal, GoalState.ABORTED, result, reason)

    def canceled(self, result: R | None = None, /) -> None:
        """End the goal as canceled, at the request of its client or of a stop."""
        self._server.end(self._goal, GoalState.CANCELED, result)


class ActionServer(Generic[G, R, F]):
    """Carries out one goal at a time. `accept` returns why it refuses a goal, or nothing."""

    def __init__(
        self,
        topics: Topics,
        services: Services,
        node: Participant,
        name: str,
        action: type[Action[G, R, F]],
        accept: Callable[[G], str],
        *,
        waits: bool = False,
        limits: MessageLimits = ORDINARY,
    ) -> None:
        """With `waits`, hold goals back until the node is open. Goals beyond the `limits` are refused."""
        names = ActionNames.of(name)
        self.current: ServedGoal[G, R, F] | None = None  # the goal to carry out; a newer one replaces it
        self.began: Callable[[], None] = lambda: None  # called when there is a goal to carry out
        self.canceling: Callable[[], None] = lambda: None  # called when the current goal should end soon
        self._name, self._action, self._accept = name, action, accept
        self._process, self._owner = node.process, node.owner
        self._goals: Goals[G, R] = Goals()
        self._asked: dict[bytes, list[ServedRequest[Any, Any]]] = {}  # result requests, by unfinished goal
        self._status_allowance = Allowance(1 / STATUS_PERIOD, GATE_BURST)
        self._pending_status: ScheduledCallback | None = None
        self._may_log, self._unlogged = Allowance(1 / LOG_PERIOD, LOG_BURST), 0
        self._will_log: ScheduledCallback | None = None
        self._feedback = Publisher(topics, node, names.feedback, action.FeedbackMessage, Qos.STATE)
        self._status = Publisher(topics, node, names.status, GoalStatusArray, Qos.LATCHED)
        self._servers: list[Server[Any, Any]] = [
            Server(services, node, names.cancel_goal, CancelGoal, self._on_cancel, rate=GOALS),
            Server(services, node, names.get_result, action.GetResult, self._on_get_result),
            Server(
                services,
                node,
                names.send_goal,
                action.SendGoal,
                self._on_send,
                self._on_client_left,
                waits=waits,
                rate=GOALS,
                limits=limits,
            ),
        ]

    def cancel_all(self, cause: str) -> None:
        """Request the cancellation of the current goal; its result says why, unless its server gives one."""
        if self._goals.current is not None:
            self._goals.current.cause = cause
        self._goals.cancel()
        self._tell_canceling()

    def publish_feedback(self, goal: Goal[G, R], message: F) -> None:
        """Publish feedback on a goal that has not ended."""
        require_type(message, self._action.Feedback, self._name)
        if goal is self._goals.current:
            self._feedback(self._action.FeedbackMessage(goal_id=UUID(goal.id), feedback=message))

    def end(self, goal: Goal[G, R], state: GoalState, result: R | None, reason: str = "") -> None:
        """End a goal that has not ended and answer all requests for its result."""
        if result is None:
            made: Any = self._action.Result()
            told = [name for name in REASONS if isinstance(getattr(made, name, None), str)][:1]
            result = replace(made, **dict.fromkeys(told, reason or goal.cause))
        require_type(result, self._action.Result, self._name)
        if not self._goals.end(goal, state, result, self._now):
            return
        self.current = None
        if reason:
            self._log(f"a goal was aborted: {reason}")
        self._update_status()
        for request in self._asked.pop(goal.id, []):
            self._reply_result(request, goal)

    def close(self) -> None:
        """Withdraw the server; its goal ends as aborted, and its clients learn that the server is gone."""
        if self._goals.current is not None:
            # The result is not sent, so that the client does not mistake this for a failure of the goal itself.
            self._goals.end(self._goals.current, GoalState.ABORTED, self._action.Result(), self._now)
            self._publish_status()
        for timer in (self._pending_status, self._will_log):
            if timer is not None:
                timer.cancel()
        self.current = None
        while self._servers:
            self._servers.pop().close()
        self._status.close()
        self._feedback.close()

    @property
    def _now(self) -> float:
        return self._process.clock.now()

    def _log(self, text: str) -> None:
        if self._may_log.takes(self._now):
            self._process.log(self._owner, f"{self._name}: {text}")
            return
        self._unlogged += 1
        if self._will_log is None:
            due = self._process.scheduler.now + LOG_PERIOD
            self._will_log = self._process.scheduler.at(due, self._owner, self._log_rest)

    def _log_rest(self) -> None:
        """Report how much of a flood was not logged."""
        self._process.log(self._owner, f"{self._name}: {self._unlogged} more goals were refused, aborted or replaced")
        self._unlogged, self._will_log = 0, None

    def _on_send(self, request: ServedRequest[Any, Any]) -> None:
        response, id_ = self._action.SendGoal.Response, request.message.goal_id.uuid
        self._goals.forget(self._now)
        reason = self._accept(request.message.goal) if self._goals.find(id_) is None else "it was sent before"
        if reason:
            self._log(f"a goal was refused: {reason}")
            request.reply(response(accepted=False), reason)
            return
        if self._goals.current is not None:
            self._replace(self._goals.current)
        goal: Goal[G, R] = Goal(id_, request.message.goal, request.client, self._process.clock.stamp())
        self._goals.accept(goal)
        self.current = ServedGoal(self, goal)
        self.began()
        self._update_status()
        request.reply(response(accepted=True, stamp=to_time(goal.accepted)))

    def _replace(self, goal: Goal[G, R]) -> None:
        if goal.state is GoalState.CANCELING:
            self.end(goal, GoalState.CANCELED, None)
        else:
            self.end(goal, GoalState.ABORTED, None, "replaced by a newer goal")

    def _on_cancel(self, request: ServedRequest[CancelGoal.Request, CancelGoal.Response]) -> None:
        info = request.message.goal_info
        code, goals = self._goals.cancel(info.goal_id.uuid, to_nanoseconds(info.stamp))
        self._tell_canceling()
        request.reply(CancelGoal.Response(return_code=code, goals_canceling=tuple(map(_info, goals))))

    def _on_get_result(self, request: ServedRequest[Any, Any]) -> None:
        self._goals.forget(self._now)
        goal = self._goals.find(request.message.goal_id.uuid)
        if goal is None:
            request.reply(self._action.GetResult.Response(status=GoalState.UNKNOWN, result=self._action.Result()))
        elif goal.state.is_end:
            self._reply_result(request, goal)
        else:
            self._asked.setdefault(goal.id, []).append(request)

    def _on_client_left(self, client: bytes) -> None:
        if self._goals.cancel_from(client):
            self._log("its goal is cancelled: the client is gone")
            self._tell_canceling()

    def _tell_canceling(self) -> None:
        if self.current is not None and self.current.cancel_requested:
            self.canceling()
        self._update_status()

    def _reply_result(self, request: ServedRequest[Any, Any], goal: Goal[G, R]) -> None:
        request.reply(self._action.GetResult.Response(status=goal.state, result=goal.result))

    def _update_status(self) -> None:
        """Publish the states of all goals: immediately, or a little later during a flood of goals."""
        if self._pending_status is None:
            if self._status_allowance.takes(self._now):
                self._publish_status()
            else:
                due = self._process.scheduler.now + STATUS_PERIOD
                self._pending_status = self._process.scheduler.at(due, self._owner, self._publish_status)

    def _publish_status(self) -> None:
        self._pending_status = None
        statuses = (GoalStatus(goal_info=_info(goal), status=goal.state) for goal in self._goals)
        self._status(GoalStatusArray(status_list=tuple(statuses)))


def _info(goal: Goal[Any, Any]) -> GoalInfo:
    return GoalInfo(goal_id=UUID(goal.id), stamp=to_time(goal.accepted))


OUTCOMES = {
    GoalState.SUCCEEDED: Outcome.SUCCEEDED,
    GoalState.CANCELED: Outcome.CANCELED,
    GoalState.ABORTED: Outcome.ABORTED,
}


class SentGoal(Generic[R]):
    """A goal as its client sees it."""

    def __init__(self, client: ActionClient[Any, R, Any], id: bytes, then: Callable[[Ended[R]], None]) -> None:
        self.id = id
        self._client, self._then = client, then
        self._is_accepted = False
        self._is_unwanted = False

    def cancel(self) -> None:
        """Ask the server to end the goal; `Ended` still follows."""
        self._is_unwanted = True
        if self._is_accepted:
            self._client.ask_to_cancel(self.id)

    def answered(self, reply: Reply[Any]) -> None:
        """Receive whether the server accepted the goal."""
        if reply.response is None:
            self._client.ask_to_cancel(self.id)  # the answer may only be late, and the goal accepted
            self._end(Ended(Outcome.LOST, message=reply.error))
        elif not reply.response.accepted:
            self._end(Ended(Outcome.REJECTED, message=reply.error or "the server refused it and gives no reason"))
        else:
            self._is_accepted = True
            self._client.ask_for_result(self)
            if self._is_unwanted:
                self._client.ask_to_cancel(self.id)

    def resulted(self, reply: Reply[Any]) -> None:
        """Receive how the goal ended."""
        if reply.error == EXPIRED:
            self._client.ask_for_result(self)  # a goal may take longer than any request may
        elif reply.response is None:
            self._end(Ended(Outcome.LOST, message=reply.error))
        elif reply.response.status in OUTCOMES:
            self._end(Ended(OUTCOMES[reply.response.status], reply.response.result))
        else:
            self._end(Ended(Outcome.LOST, message="the server does not know it"))

    def _end(self, ended: Ended[R]) -> None:
        self._client.forget(self.id)
        self._then(ended)


class ActionClient(Generic[G, R, F]):
    """Sends goals to an action server."""

    def __init__(
        self, topics: Topics, services: Services, node: Participant, name: str, action: type[Action[G, R, F]]
    ) -> None:
        names = ActionNames.of(name)
        self._name, self._action = name, action
        self._ids = count(1)
        self._listeners: dict[bytes, Callable[[F], None]] = {}  # feedback callbacks, by goal
        self._feedback = Subscription(
            topics, node, names.feedback, action.FeedbackMessage, Qos.STATE, self._on_feedback, listens=False
        )
        self._feedback.is_wanted = lambda: bool(self._listeners)  # many clients never use feedback
        self._send: Client[Any, Any] = Client(services, node, names.send_goal, action.SendGoal)
        self._cancel = Client(services, node, names.cancel_goal, CancelGoal)
        self._result: Client[Any, Any] = Client(services, node, names.get_result, action.GetResult)

    @property
    def is_available(self) -> bool:
        """Return whether a server is known."""
        return self._send.is_available and self._cancel.is_available and self._result.is_available

    def watch(self, changed: Callable[[bool], None]) -> None:
        """Call `changed` when a server appears, and when the last one is gone."""
        self._send.watch(changed)  # a server declares this service last

    def __call__(
        self, goal: G, then: Callable[[Ended[R]], None], feedback: Callable[[F], None] | None = None, /
    ) -> SentGoal[R]:
        """Send `goal`; `then` receives its end exactly once."""
        require_type(goal, self._action.Goal, self._name)
        # Unique among all clients, yet the same in every run on a stepped clock.
        id_ = xxhash.xxh3_128_digest(self._send.gid + next(self._ids).to_bytes(8, "little"))
        sent: SentGoal[R] = SentGoal(self, id_, then)
        if feedback is not None:
            self._listeners[id_] = feedback
            self._feedback.listen()
        self._send(self._action.SendGoal.Request(goal_id=UUID(id_), goal=goal), sent.answered)
        return sent

    def ask_for_result(self, goal: SentGoal[R]) -> None:
        """Wait for the end of a goal, however long it takes."""
        self._result(self._action.GetResult.Request(goal_id=UUID(goal.id)), goal.resulted, timeout=math.inf)

    def ask_to_cancel(self, id: bytes) -> None:
        """Request the cancellation of a goal; its result will show whether it could still be cancelled."""
        self._cancel(CancelGoal.Request(goal_info=GoalInfo(goal_id=UUID(id))), lambda reply: None)

    def forget(self, id: bytes) -> None:
        """Stop listening to feedback on a goal."""
        self._listeners.pop(id, None)

    def close(self) -> None:
        """Withdraw the client; the server cancels its goals."""
        self._feedback.close()
        for client in (self._send, self._cancel, self._result):
            client.close()

    def _on_feedback(self, message: Any) -> None:
        listener = self._listeners.get(message.goal_id.uuid)
        if listener is not None:
            listener(message.feedback)
