"""Windows of a robot's components as a visitor on its bus sees them: whole states from queries, and updates since."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, Protocol

from rbxcompose.bus.inbox import Inbox
from rbxcompose.bus.names import admin_key
from rbxcompose.bus.transport import Arrival, Transport, TransportReply
from rbxcompose.bus.window import SCHEMA
from rbxcompose.key_feed import added
from rbxcompose.missions.view.replica import Replica
from rbxcompose.qos import Qos
from rbxcompose.scheduler import Scheduler

NAME = "_rbxcompose"  # of the visitor
LONGEST_QUEUE = 1000  # updates that wait
AGAIN = 0.5  # [s] after which a query without an answer is repeated: a component may be busy
Changed = Callable[[str, Mapping[str, Any]], None]


class Visitor(Protocol):
    """Who looks: a guest of the bus."""

    transport: Any
    scheduler: Scheduler
    clock: Any


class WindowViews:
    """Follows windows at some paths; `changed` is called with a path and all that is known there."""

    def __init__(self, guest: Visitor, robot: str, paths: Iterable[str], changed: Changed) -> None:
        self._guest, self._robot, self._changed = guest, robot, changed
        self._replicas = {path: Replica(added) for path in paths}
        self._asked: set[str] = set()
        transport: Transport = guest.transport
        for path in self._replicas:
            news: Inbox[bytes] = Inbox(NAME, LONGEST_QUEUE, partial(self._heard, path), guest.scheduler.post)
            transport.subscribe(admin_key(robot, path), Qos.STATE, partial(self._arrived, news))
            self._ask(path)

    @property
    def seen(self) -> Mapping[str, Mapping[str, Any]]:
        """Return what is known, by path; nothing where no answer has come."""
        return {path: one.seen for path, one in self._replicas.items() if one.seen}

    def _arrived(self, inbox: Inbox[bytes], arrival: Arrival) -> None:
        self._put(inbox, arrival.payload)

    def _put(self, inbox: Inbox[Any], item: Any) -> None:
        inbox.put(item, self._guest.transport.wake)

    def _ask(self, path: str) -> None:
        if path in self._asked:
            return
        self._asked.add(path)
        inbox: Inbox[TransportReply] = Inbox(NAME, None, partial(self._answered, path), self._guest.scheduler.post)
        self._guest.transport.ask(admin_key(self._robot, path), b"", b"", partial(self._put, inbox))

    def _answered(self, path: str, answer: TransportReply) -> None:
        if path not in self._asked:
            return  # the end of an answered query is reported, too
        self._asked.discard(path)
        message = None if answer.error else _read(answer.payload)
        if message is None:
            self._guest.scheduler.at(self._guest.clock.now() + AGAIN, NAME, partial(self._ask, path))
            return
        self._follow(path, self._replicas[path].answered(message))

    def _heard(self, path: str, payload: bytes) -> None:
        if (message := _read(payload)) is not None:
            self._follow(path, self._replicas[path].heard(message))

    def _follow(self, path: str, is_asked: bool) -> None:
        if is_asked:
            self._ask(path)
        elif self._replicas[path].seen:
            self._changed(path, self._replicas[path].seen)


def _read(payload: bytes) -> dict[str, Any] | None:
    """Return a message, or None if the robot runs another version with another format."""
    message: dict[str, Any] = json.loads(payload)
    return message if message.get("schema") == SCHEMA else None
