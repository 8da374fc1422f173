"""Messages on the command line: reading YAML with source positions, showing YAML or JSON lines, finding types."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from typing import Any, TypeVar

import yaml

from rbxcompose.bus.graph import GraphName, WireType
from rbxcompose.cli.bus.guest import HeardMessage
from rbxcompose.cli.output.console import NotDoneError, refuse, tell_report
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Report, Span, kind
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.scalars import plain_value
from rbxcompose.manifest.tree import MappingNode, ScalarNode, TreeNode, key_span, value_span
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.plain import KeyPath, from_plain
from rbxcompose.msgs.types import Interface, Message
from rbxcompose.printable import FORBIDDEN

NO_TYPE = kind("RBX9021")
MOST_SHOWN = 128  # values of a list that text shows; JSON shows all
_SHOWN = "MESSAGE"  # name of the message text in findings
M = TypeVar("M", bound=Message)
T = TypeVar("T", bound=Interface)


@dataclass(frozen=True, slots=True)
class _Places:
    """Source positions within a tree."""

    root: TreeNode

    def key(self, path: KeyPath) -> Span:
        """Return the position of a key."""
        return key_span(self.root, path)

    def value(self, path: KeyPath) -> Span:
        """Return the position of a value."""
        return value_span(self.root, path)


def message_from(message: type[M], text: str) -> M | None:
    """Read a message from YAML; an empty text means all defaults. On mistakes, report them and return None."""
    if not text.strip():
        return message()
    root, findings = read_text(text, _SHOWN)
    made: M | None = None
    if root is not None and not findings:
        made, findings = from_plain(message, _data(root), _Places(root))
    if findings:
        report = Report()
        report.extend(findings)
        tell_report(report, {_SHOWN: text})
        return None
    return made


def _data(node: TreeNode) -> object:
    match node:
        case ScalarNode():
            return plain_value(node)
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
        full = registry.full_name(name, category)
        words = f"unknown type '{full}'"
        raise NotDoneError(NO_TYPE.misspelt(None, words, full, registry.names(category), "known types")) from None


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
        return [_finite(one) for one in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


class EchoReader:
    """Decodes the messages of a topic; it counts those it cannot read and reports each such type once."""

    def __init__(self, topic: GraphName) -> None:
        self.malformed = 0
        self._types: dict[WireType, type[Message]] = {}
        for one in topic.kinds:
            try:
                self._types[one] = type_of(one, "msg", registry.message)
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
