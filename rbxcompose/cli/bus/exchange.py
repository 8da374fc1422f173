"""What sends or shows messages: `topic echo` and `pub`, `service call`, `action send`."""

from __future__ import annotations

import argparse
import math
import sys
from typing import Any

from rbxcompose.bus.graph import GraphName, WireType, find
from rbxcompose.bus.names import name_problem
from rbxcompose.cli.bus.guest import NAME, NO_NAME, NOBODY, SAID_NO, Guest, HeardMessage, wanted
from rbxcompose.cli.bus.messages import EchoReader, message_from, message_type, shown, to_json, to_text, type_of
from rbxcompose.cli.output.console import NotDoneError, refuse, tell
from rbxcompose.findings import Finding
from rbxcompose.msgs import registry
from rbxcompose.msgs.plain import to_plain
from rbxcompose.msgs.types import Message
from rbxcompose.qos import Qos
from rbxcompose.sdk.bound import Ended, Outcome, Reply

_PERIOD = 1.0  # [s] between two notices about messages left out


class _Echo:
    """Prints messages until there are enough."""

    def __init__(self, topic: GraphName, arguments: argparse.Namespace) -> None:
        self.reader = EchoReader(topic)
        self._arguments, self._count = arguments, 0

    @property
    def is_over(self) -> bool:
        """Return whether enough has been printed."""
        return self._arguments.count is not None and self._count >= self._arguments.count

    def heard(self, heard: HeardMessage) -> None:
        """Print a message, unless it is one too many."""
        message = None if self.is_over else self.reader.read(heard)
        if message is not None:
            self._count += 1
            text = shown(to_plain(message), self._arguments.json)
            tell(text if self._arguments.json else f"{text}\n---")


def echo(guest: Guest, arguments: argparse.Namespace) -> int:
    """Print the messages of a topic."""
    topic = wanted(guest.graph().topics, arguments.topic, "topic")
    told = _Echo(topic, arguments)
    if told.reader.is_useless:
        return 1
    guest.listen(topic, told.heard)
    dropped = 0
    while not guest.run(lambda: told.is_over, _PERIOD):
        if guest.dropped > dropped:
            sys.stderr.write(f"left out: {guest.dropped - dropped} messages, which came too fast to show\n")
            dropped = guest.dropped
    return 0


def publish(guest: Guest, arguments: argparse.Namespace) -> int:
    """Publish a message as soon as there is a subscriber, and report how often."""
    message = message_type(arguments.type)
    made = message_from(message, arguments.message)
    if made is None:
        return 1
    name = f"/{arguments.topic.lstrip('/')}"
    if problem := name_problem(name):
        return refuse(NO_NAME.at(None, problem))
    topic = find(guest.graph().topics, name)
    of_type = [kind for kind in (topic.kinds if topic else ()) if kind.type == message.TYPE]
    publisher = guest.bus(of_type[0] if of_type else None).publisher(NAME, name, message, Qos.EVENT)
    if not guest.run(lambda: publisher.has_match, arguments.timeout):
        raise NotDoneError(_nobody(topic, name, message, of_type))
    most = arguments.count or (math.inf if arguments.rate else 1)
    sent = 0
    with guest.interruptible():
        while sent < most and not guest.is_interrupted:
            publisher(made)
            sent += 1
            if sent < most:
                guest.run(lambda: guest.is_interrupted, 1 / (arguments.rate or 1.0))
    tell(to_json({"topic": name, "type": message.TYPE, "sent": sent}) if arguments.json else f"{name}: {sent} sent")
    return 0


def _nobody(topic: GraphName | None, name: str, message: type[Message], of_type: list[WireType]) -> Finding:
    if topic is None or not topic.takers:
        return NOBODY.at(None, f"nothing subscribes to '{name}'")
    others = ", ".join(topic.types)
    if not of_type:
        return NOBODY.at(None, f"'{name}' is not of type {message.TYPE}, but {others}")
    return NOBODY.at(None, f"the subscribers of '{name}' have another definition of {message.TYPE}")


def call(guest: Guest, arguments: argparse.Namespace) -> int:
    """Send a request and print the response."""
    found = wanted([one for one in guest.graph().services if one.givers], arguments.name, "service")
    kind = found.kinds[0]
    service = type_of(kind, "srv", registry.service)
    request = message_from(service.Request, arguments.content)
    if request is None:
        return 1
    client = guest.bus(kind).client(NAME, found.name, service)
    if not guest.run(lambda: client.is_available, arguments.timeout):
        return refuse(NOBODY.at(None, f"the server of '{found.name}' cannot be reached"))
    replies: list[Reply[Any]] = []
    client(request, replies.append, timeout=arguments.timeout)
    guest.run(lambda: bool(replies))
    if replies[0].response is None:
        return refuse(SAID_NO.at(None, f"'{found.name}': {replies[0].error}"))
    tell(shown(to_plain(replies[0].response), arguments.json))
    return 0


_INTERRUPTED = 130


def send(guest: Guest, arguments: argparse.Namespace) -> int:
    """Send a goal and print its feedback and its result."""
    found = wanted([one for one in guest.graph().actions if one.givers], arguments.name, "action")
    action = type_of(found.kinds[0], "action", registry.action, lambda found: found.SendGoal.HASH)
    goal = message_from(action.Goal, arguments.content)
    if goal is None:
        return 1
    client = guest.bus(found.kinds[0]).action_client(NAME, found.name, action)
    if not guest.run(lambda: client.is_available, arguments.timeout):
        return refuse(NOBODY.at(None, f"the server of '{found.name}' cannot be reached"))
    ends: list[Ended[Any]] = []
    sent = client(goal, ends.append, lambda feedback: _tell("feedback", feedback, arguments.json))
    with guest.interruptible(sent.cancel):
        guest.run(lambda: bool(ends))
    return _end(ends[0], found.name, guest.is_interrupted, arguments.json)


def _end(ended: Ended[Any], name: str, is_interrupted: bool, as_json: bool) -> int:
    if ended.result is not None:
        _tell("result", ended.result, as_json)
    if is_interrupted:
        return _INTERRUPTED
    if ended.outcome is Outcome.SUCCEEDED:
        return 0
    message = getattr(ended.result, "error_msg", "") or ended.message
    return refuse(SAID_NO.at(None, f"'{name}': {ended.outcome}{message and f', {message}'}"))


def _tell(what: str, message: Message, as_json: bool) -> None:
    data = {what: to_plain(message)}
    tell(to_json(data) if as_json else to_text(data))
