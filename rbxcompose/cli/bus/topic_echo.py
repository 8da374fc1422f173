"""`topic echo`."""

from __future__ import annotations

import argparse
import sys

from rbxcompose.bus.graph import GraphName, WireType
from rbxcompose.cli.bus.entities import wanted
from rbxcompose.cli.bus.guest import Guest, HeardMessage
from rbxcompose.cli.bus.messages import shown, type_of
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.plain import to_plain
from rbxcompose.msgs.types import Message

_PERIOD = 1.0  # [s] between two notices about messages left out


class EchoReader:
    """Decodes the messages of a topic; it counts those it cannot read and reports each such type once."""

    def __init__(self, topic: GraphName) -> None:
        self.malformed = 0
        self._types: dict[WireType, type[Message]] = {}
        for kind in topic.kinds:
            try:
                self._types[kind] = type_of(kind, "msg", registry.message)
            except NotDoneError as error:
                refuse(error.finding)
        self.is_useless = not self._types

    def read(self, heard: HeardMessage) -> Message | None:
        """Return the message, or None if it cannot be read."""
        if heard.kind not in self._types:
            return None
        try:
            return decode(self._types[heard.kind], heard.arrival.payload)
        except CdrError as error:
            self.malformed += 1
            if self.malformed == 1:
                sys.stderr.write(f"left out: {error}\n")
            return None


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
