"""`scene watch`: the goals and plans of arms, and the scene, as a visitor on the bus sees them change."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, Protocol

from rbxcompose.base.printable import plain
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.local import Inbox
from rbxcompose.bus.names import admin_key
from rbxcompose.bus.services import SCHEMA
from rbxcompose.bus.transport import LONGEST_WAIT, Arrival, Transport, TransportReply
from rbxcompose.commands.console import NotDoneError, emit
from rbxcompose.commands.guest import Guest
from rbxcompose.commands.lookup import NO_ANSWER, known_state, place_of
from rbxcompose.domains.arms.scene_view import ARM, ARM_WINDOW, SCENE_WINDOW
from rbxcompose.missions.view.replica import Replica
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.sdk.bound import added
from rbxcompose.sdk.ports import Qos

_LONGEST = 300  # letters of a goal or a reason


def watch(folder: RobotFolder, *, as_json: bool) -> int:
    """Print a line for each change until Ctrl-C; as JSON all that is known then, with its `window`."""
    if (state := known_state(folder)) is None:
        raise NotDoneError(NO_ANSWER.at(None, "the robot does not report its arms"))
    arms = [component.name for component in state.components if component.type == ARM]

    def changed(path: str, seen: Mapping[str, Any]) -> None:
        emit(json.dumps({"window": path, **seen}) if as_json else line_of(seen))

    with Guest(place_of(folder)) as guest, guest.interruptible():
        paths = (SCENE_WINDOW, *(f"{ARM_WINDOW}/{name}" for name in arms))
        WindowViews(guest, state.robot, paths, changed)
        guest.run(lambda: guest.is_interrupted)
    return 0


def line_of(seen: Mapping[str, Any]) -> str:
    """Return what is known of an arm or the scene, in a line."""
    problem = f"; nothing is planned: {seen['problem']}" if seen["problem"] else ""
    if "arm" not in seen:
        names = [key.partition(" ")[2] for key in seen if key.startswith("object ")]
        return plain(f"scene: {', '.join(names) or 'empty'}{problem}", _LONGEST)
    if seen["goal"]:
        way = f", {seen['duration']:.1f} s" if seen["duration"] and seen["state"] != "planning" else ""
        return plain(f"{seen['arm']}: {seen['state']}, {seen['goal']}{way}{problem}", _LONGEST)
    ended = f", {seen['outcome']}" if seen["outcome"] else ""
    return plain(f"{seen['arm']}: {seen['state']}{ended}{': ' if seen['message'] else ''}{seen['message']}", _LONGEST)


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
            news: Inbox[bytes] = Inbox(NAME, LONGEST_QUEUE, partial(self._received, path), guest.scheduler.post)
            transport.subscribe(admin_key(robot, path), Qos.STATE, partial(self._arrived, news))
            self._ask(path)

    @property
    def seen(self) -> Mapping[str, Mapping[str, Any]]:
        """Return what is known, by path; nothing where no answer has come."""
        return {path: replica.seen for path, replica in self._replicas.items() if replica.seen}

    def _arrived(self, inbox: Inbox[bytes], arrival: Arrival) -> None:
        self._put(inbox, arrival.payload)

    def _put(self, inbox: Inbox[Any], item: Any) -> None:
        inbox.put(item, self._guest.transport.wake)

    def _ask(self, path: str) -> None:
        if path in self._asked:
            return
        self._asked.add(path)
        inbox: Inbox[TransportReply] = Inbox(NAME, None, partial(self._answered, path), self._guest.scheduler.post)
        answered = partial(self._put, inbox)
        self._guest.transport.ask(admin_key(self._robot, path), b"", b"", answered, of_all=True, within=LONGEST_WAIT)

    def _answered(self, path: str, answer: TransportReply) -> None:
        if path not in self._asked:
            return  # the end of an answered query is reported, too
        self._asked.discard(path)
        message = None if answer.error else _window_message(answer.payload)
        if message is None:
            self._guest.scheduler.at(self._guest.clock.now() + AGAIN, NAME, partial(self._ask, path))
            return
        self._follow(path, self._replicas[path].answered(message))

    def _received(self, path: str, payload: bytes) -> None:
        if (message := _window_message(payload)) is not None:
            self._follow(path, self._replicas[path].apply(message))

    def _follow(self, path: str, is_asked: bool) -> None:
        if is_asked:
            self._ask(path)
        elif self._replicas[path].seen:
            self._changed(path, self._replicas[path].seen)


def _window_message(payload: bytes) -> dict[str, Any] | None:
    """Return a message, or None if the robot runs another version with another format."""
    message: dict[str, Any] = json.loads(payload)
    return message if message.get("schema") == SCHEMA else None
