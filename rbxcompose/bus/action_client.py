"""Action clients: send a goal, perhaps cancel it, and receive its end exactly once."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import count
from typing import Any, Generic, TypeVar

import xxhash

from rbxcompose.bus.goals import GoalState
from rbxcompose.bus.local import Participant
from rbxcompose.bus.names import ActionNames
from rbxcompose.bus.services import Client, Services
from rbxcompose.bus.topics import Subscription, Topics
from rbxcompose.bus.transport import EXPIRED
from rbxcompose.msgs.action_msgs import CancelGoal, GoalInfo
from rbxcompose.msgs.types import Action, Message
from rbxcompose.msgs.unique_identifier_msgs import UUID
from rbxcompose.qos import Qos
from rbxcompose.sdk.bound import Ended, Outcome, Reply

G = TypeVar("G", bound=Message)
R = TypeVar("R", bound=Message)
F = TypeVar("F", bound=Message)

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
            self._end(Ended(Outcome.REJECTED, message="the server refused it"))
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
        self._action = action
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
