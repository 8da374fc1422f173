"""Windows: state of a component that tools outside may see, at a key of the robot's own rather than a ROS 2 topic.

A subscriber at the key receives updates, a query there returns the whole state. Both are JSON of one shape (`SCHEMA`):
`source` names the window, `sequence` counts the updates from one, so that a subscriber notices what it missed, and
`value` is the component's data. A whole state has the sequence of the last update that it contains.
`missions/view/replica.py` is the other side.
"""

import json
from collections.abc import Callable

from rbxcompose.base.requests import Refused
from rbxcompose.bus.local import QUESTIONS, Gate, Inbox, Participant
from rbxcompose.bus.transport import Closable, Question
from rbxcompose.sdk.ports import Qos

SCHEMA = 1
GRACE = 2.0  # [s] after a query in which somebody counts as listening: the transport may report a listener late


class Window:
    """Sends updates to subscribers; `answer` returns the whole state as data for JSON, or raises Refused."""

    def __init__(self, node: Participant, key: str, answer: Callable[[], object]) -> None:
        process, transport = node.process, node.process.transport
        self._source = f"{transport.session}/{next(process.ids)}"
        self._clock, self._answer = process.clock, answer
        self._sequence = 0
        self._asked_at: float | None = None  # [s]
        self._remote = transport.publisher(key, Qos.STATE)  # a slow viewer must not hold us up
        inbox: Inbox[Question] = Inbox(node.owner, None, self._asked, process.scheduler.post)
        gate = Gate(node, key, QUESTIONS, lambda question: inbox.put(question, transport.wake))
        self._declared: list[Closable] = [gate, transport.serve(key, gate), self._remote]

    @property
    def is_watched(self) -> bool:
        """Return whether anybody would receive updates."""
        if self._remote.has_match:
            return True
        return self._asked_at is not None and self._clock.now() - self._asked_at <= GRACE

    def put(self, value: object) -> None:
        """Send an update, as data for JSON."""
        self._sequence += 1
        self._remote.put(self._message(value), b"")

    def close(self) -> None:
        """Withdraw the window."""
        for closable in self._declared:
            closable.close()

    def _asked(self, question: Question) -> None:
        self._asked_at = self._clock.now()
        try:
            message = self._message(self._answer())
        except Refused as refusal:
            question.fail(str(refusal))
        except (Exception, SystemExit) as error:
            question.fail(f"{type(error).__name__}: {error}")
            raise
        else:
            question.reply(message, b"")

    def _message(self, value: object) -> bytes:
        message = {"schema": SCHEMA, "source": self._source, "sequence": self._sequence, "value": value}
        return json.dumps(message).encode()
