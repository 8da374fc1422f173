"""Messages on the command line: read from YAML with places, shown as YAML or JSON, sent and received."""

import argparse
import json
import math
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any, TypeVar

import yaml

from rbxcompose.base.findings import Finding, Report, kind
from rbxcompose.base.printable import FORBIDDEN
from rbxcompose.bus.graph import GraphName, WireType, find
from rbxcompose.commands.console import INTERRUPTED, NotDoneError, emit, refuse, write_report
from rbxcompose.commands.guest import NAME, NO_NAME, NOBODY, SAID_NO, Guest, ReceivedMessage, silence, wanted
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode, NodePlaces, ScalarNode, TreeNode, number_or_infinity
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.plain import from_plain, to_plain
from rbxcompose.msgs.types import Interface, Message
from rbxcompose.sdk.bound import Ended, Outcome, Reply
from rbxcompose.sdk.ports import Qos, name_problem

NO_TYPE = kind("RBX9021")
MOST_SHOWN = 128  # values of a list that text shows; JSON shows all
_SHOWN = "MESSAGE"  # name of the message text in findings
M = TypeVar("M", bound=Message)
T = TypeVar("T", bound=Interface)
_PERIOD = 1.0  # [s] between two notices about messages left out
_SILENT = 3  # periods without a first message, after which there is a notice about that


def message_from(message: type[M], text: str) -> M | None:
    """Read a message from YAML; an empty text means all defaults. On mistakes, report them and return None."""
    if not text.strip():
        return message()
    root, findings = read_text(text, _SHOWN, takes_infinity=True)
    made: M | None = None
    if root is not None and not findings:
        made, findings = from_plain(message, _data(root), NodePlaces(root))
    if findings:
        write_report(Report([replace(finding, fix=None) for finding in findings]), {_SHOWN: text})  # of no file
        return None
    return made


def _data(node: TreeNode) -> object:
    match node:
        case ScalarNode():
            return number_or_infinity(node)
        case MappingNode(entries=entries):
            return {name: _data(entry.value) for name, entry in entries.items()}
    return [_data(item) for item in node.items]


def to_text(data: object) -> str:
    """Return plain data as YAML that could be read back; only long lists are cut."""
    shown = yaml.safe_dump(_cut(data), sort_keys=False, default_flow_style=None, width=math.inf, allow_unicode=True)
    return FORBIDDEN.sub("?", str(shown)).removesuffix("\n...\n").rstrip("\n")


def to_json(data: object) -> str:
    """Return plain data as one line of JSON, with null for numbers that are not finite."""
    return json.dumps(_finite(data), ensure_ascii=True)


def shown(data: object, as_json: bool) -> str:
    """Return plain data as JSON or as text."""
    return to_json(data) if as_json else to_text(data)


def message_type(name: str) -> type[Message]:
    """Return the message type of that name.

    Raises:
        NotDoneError: if there is none.
    """
    return _known(name, "msg", registry.message)


def type_of(
    one: WireType,
    category: str,
    look: Callable[[str], type[T]],
    hash_of: Callable[[type[T]], str] = lambda found: found.HASH,
) -> type[T]:
    """Return our class of a type that others on the bus use; `hash_of` gives its hash on the bus.

    Raises:
        NotDoneError: if we lack the type or define it differently.
    """
    found = _known(one.type, category, look)
    if one.hash.startswith("RIHS01_") and one.hash != hash_of(found):
        words = f"the bus has another definition of '{one.type}' ({one.hash}) than this program ({hash_of(found)})"
        raise NotDoneError(NO_TYPE.at(None, words))
    return found


def _known(name: str, category: str, look: Callable[[str], type[T]]) -> type[T]:
    try:
        return look(name)
    except KeyError:
        if finds_types_here():
            return _known(name, category, look)
        full = registry.full_name(name, category)
        words = f"unknown type '{full}'"
        raise NotDoneError(NO_TYPE.misspelt(None, words, full, registry.names(category), "known types")) from None


def finds_types_here() -> bool:
    """Let names mean the types of the only robot in this folder, unless they mean those of one; return if it has any.

    On a bus that no robot of this machine has, they are the best guess; a hash tells whether it is right.
    """
    if registry.chosen().texts:
        return False
    from rbxcompose.commands.targets import robot_path  # the imports of a compiler, which known types do not need
    from rbxcompose.compiler.compile import compile_robot

    with suppress(NotDoneError):
        compile_robot(robot_path(None, may_run=False), environment=os.environ)
    return bool(registry.chosen().texts)


def _cut(data: Any) -> Any:
    if isinstance(data, dict):
        return {name: _cut(value) for name, value in data.items()}
    if isinstance(data, list):
        rest = len(data) - MOST_SHOWN
        return [_cut(one) for one in data[:MOST_SHOWN]] + ([f"... and {rest} more"] if rest > 0 else [])
    return data


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {name: _finite(value) for name, value in data.items()}
    if isinstance(data, list):
        return [_finite(item) for item in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


class EchoReader:
    """Decodes the messages of a topic; it counts those it cannot read and reports each such type once."""

    def __init__(self, topic: GraphName) -> None:
        self.malformed = 0
        self._types: dict[WireType, type[Message]] = {}
        for wire_type in topic.kinds:
            try:
                self._types[wire_type] = type_of(wire_type, "msg", registry.message)
            except NotDoneError as error:
                refuse(error.finding)
        self.is_useless = not self._types

    def read(self, received: ReceivedMessage) -> Message | None:
        """Return the message, or None if it cannot be read."""
        if received.kind not in self._types:
            return None
        try:
            return decode(self._types[received.kind], received.arrival.payload)
        except CdrError as error:
            self.malformed += 1
            if self.malformed == 1:
                sys.stderr.write(f"left out: {error}\n")
            return None


def echo(guest: Guest, arguments: argparse.Namespace) -> int:
    """Print the messages of a topic, until there are enough."""
    topic = wanted(guest.graph().topics, arguments.topic, "topic")
    reader = EchoReader(topic)
    if reader.is_useless:
        return 1
    left = math.inf if arguments.count is None else arguments.count
    waits = _SILENT if topic.givers else 0

    def received(received: ReceivedMessage) -> None:
        nonlocal left, waits
        waits = 0
        message = reader.read(received) if left > 0 else None
        if message is not None:
            left -= 1
            text = shown(to_plain(message), arguments.json)
            emit(text if arguments.json else f"{text}\n---")

    guest.listen(topic, received)
    dropped = 0
    while not guest.run(lambda: left <= 0, _PERIOD):
        if guest.dropped > dropped:
            sys.stderr.write(f"left out: {guest.dropped - dropped} messages, which came too fast to show\n")
            dropped = guest.dropped
        if waits == 1:
            write_report(Report([silence(topic.name)]), {})
        waits = max(0, waits - 1)
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
    if topic is not None and topic.takers and not of_type:
        raise NotDoneError(_nobody(topic, name, message, of_type))  # subscribers would report a publisher of that type
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
    emit(to_json({"topic": name, "type": message.TYPE, "sent": sent}) if arguments.json else f"{name}: {sent} sent")
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
    found = wanted([name for name in guest.graph().services if name.givers], arguments.name, "service")
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
    emit(shown(to_plain(replies[0].response), arguments.json))
    return 0


def send(guest: Guest, arguments: argparse.Namespace) -> int:
    """Send a goal and print its feedback and its result."""
    found = wanted([name for name in guest.graph().actions if name.givers], arguments.name, "action")
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
        guest.run(lambda: bool(ends) or guest.is_interrupted)
        if not guest.run(lambda: bool(ends), arguments.timeout):
            words = f"'{found.name}': the goal has not ended within {arguments.timeout:g} s of the request to cancel it"
            return refuse(NOBODY.at(None, f"{words}; its server may still carry it out"))
    return _end(ends[0], found.name, guest.is_interrupted, arguments.json)


def _end(ended: Ended[Any], name: str, is_interrupted: bool, as_json: bool) -> int:
    if ended.result is not None:
        _tell("result", ended.result, as_json)
    if is_interrupted:
        sys.stderr.write(f"'{name}': {ended.outcome}\n")  # its result may look like that of a success
        return INTERRUPTED
    if ended.outcome is Outcome.SUCCEEDED:
        return 0
    message = getattr(ended.result, "error_msg", "") or ended.message
    return refuse(SAID_NO.at(None, f"'{name}': {ended.outcome}{message and f', {message}'}"))


def _tell(what: str, message: Message, as_json: bool) -> None:
    data = {what: to_plain(message)}
    emit(to_json(data) if as_json else to_text(data))
