"""The missions of a robot as a visitor on its bus sees them: whole states from queries, and updates since."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from rbxcompose.bus.inbox import Inbox
from rbxcompose.bus.names import admin_key
from rbxcompose.bus.transport import TransportReply
from rbxcompose.bus.window import SCHEMA
from rbxcompose.cli.bus.guest import LONGEST_QUEUE, NAME, Guest
from rbxcompose.missions.program.statuses import IDLE, NAMES
from rbxcompose.missions.view.replica import Replica
from rbxcompose.qos import Qos

_PATH = "missions"


class MissionsSeen:
    """Follows all missions of a robot; `by_name` has the state of those that have been running."""

    def __init__(self, guest: Guest, robot: str) -> None:
        self._guest, self._robot = guest, robot
        self._replicas: dict[str, Replica] = {}
        self._asked: set[str] = set()  # paths with a pending answer
        self._is_listed = False
        news: Inbox[bytes] = Inbox(NAME, LONGEST_QUEUE, self._heard, guest.scheduler.post)
        transport = guest.transport
        pattern = f"{admin_key(robot, _PATH)}/*"
        transport.subscribe(pattern, Qos.STATE, lambda arrival: news.put(arrival.payload, transport.wake))
        self.look()

    @property
    def by_name(self) -> Mapping[str, Mapping[str, Any]]:
        """Return the known state of each mission, with its picture."""
        return {name: one.seen for name, one in self._replicas.items() if one.seen}

    @property
    def is_complete(self) -> bool:
        """Return whether all answers have arrived."""
        return self._is_listed and not self._asked

    def look(self) -> None:
        """Query the list of missions, unless it is known; a robot that has just started may not answer yet."""
        if not self._is_listed:
            self._ask(_PATH)

    def _ask(self, path: str) -> None:
        if path in self._asked:
            return
        self._asked.add(path)
        transport, answers = self._guest.transport, _Answers(self, path)
        inbox: Inbox[TransportReply] = Inbox(NAME, None, answers.take, self._guest.scheduler.post)
        transport.ask(admin_key(self._robot, path), b"", b"", lambda answer: inbox.put(answer, transport.wake))

    def answered(self, path: str, answer: TransportReply) -> None:
        """Apply the first answer to a query."""
        self._asked.discard(path)
        if answer.error:
            return
        if (message := _read(answer.payload)) is None:
            return
        if path == _PATH:
            self._is_listed = True
            for one in message["value"]:
                if one["state"] != NAMES[IDLE]:
                    self._ask(f"{_PATH}/{one['name']}")
            return
        name = message["value"]["mission"]
        if self._replicas.setdefault(name, Replica()).answered(message):
            self._ask(path)

    def _heard(self, payload: bytes) -> None:
        if (message := _read(payload)) is None:
            return
        name = message["value"]["mission"]
        if self._replicas.setdefault(name, Replica()).heard(message):
            self._ask(f"{_PATH}/{name}")


def _read(payload: bytes) -> dict[str, Any] | None:
    """Return a message, or None if the robot runs another version with another format."""
    message: dict[str, Any] = json.loads(payload)
    return message if message.get("schema") == SCHEMA else None


class _Answers:
    """The answers to one query: it ends with an error even after an answer, so only the first counts."""

    def __init__(self, asking: MissionsSeen, path: str) -> None:
        self._asking, self._path = asking, path
        self._is_over = False

    def take(self, answer: TransportReply) -> None:
        if not self._is_over:
            self._is_over = True
            self._asking.answered(self._path, answer)
