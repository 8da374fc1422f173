"""Reads the values and options of one mission node; each kind asks for what belongs to it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Protocol

from rbxcompose.expressions.text import Slot, Template, parse_template
from rbxcompose.expressions.tree import Expression, ExpressionError, Number
from rbxcompose.expressions.types import COUNT, FLAG, UNKNOWN, Type, quantity_of
from rbxcompose.findings import Finding, Span, replacement
from rbxcompose.manifest.scalars import plain_value
from rbxcompose.manifest.tree import Entry, Mapping, Node, Scalar, Sequence
from rbxcompose.missions import codes
from rbxcompose.missions.messages import Message, Shape, Written
from rbxcompose.missions.moments import DEEDS, LEVELS, OPTIONS, Deeds, Moments
from rbxcompose.missions.other_words import ENDLESS, FLAGS, not_our_word
from rbxcompose.missions.program import Argument, Asked, Assignment
from rbxcompose.missions.spans import expression_of, inner_span
from rbxcompose.units import NUMBER, TIME

FOREVER = "forever"
WORDS = "it can be"
NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")

# Stands for an expression that could not be read, so that the rest is read all the same.
UNREADABLE = Expression("", Number(0, 0, 0.0, NUMBER))


class Nodes(Protocol):
    """Who reads the nodes below, and keeps the findings."""

    def child(self, node: Node, step: str, parent: int) -> int:
        """Read a node below `parent` and return its number; `step` is the next part of its path."""
        ...

    def state(self, name: str, entry: Entry, parent: int) -> int:
        """Read a state of the machine `parent` and return its number."""
        ...

    def loop(self, item: str, expression: Expression) -> None:
        """Note what the item of a loop is that goes through the value of an expression."""
        ...

    def held(self, expression: Expression, parent: int) -> list[int]:
        """Read the nodes in the data that an expression may give, below `parent`, and return their numbers."""
        ...

    def add(self, finding: Finding) -> None:
        """Keep a finding."""
        ...


def read_expression(scalar: Scalar, nodes: Nodes) -> Expression | None:
    """Return the expression in a scalar; None, and a finding, if there is none."""
    try:
        return expression_of(scalar)
    except ExpressionError as error:
        span = inner_span(scalar, error.start, error.end) if scalar.text else scalar.span
        nodes.add(codes.NO_EXPRESSION.at(span, error.message, help=error.help))
        return None


class NodeReader:
    """One mapping of a mission, being read: `key` is the word of its kind, or the name of its skill."""

    def __init__(self, mapping: Mapping, key: str, number: int, nodes: Nodes) -> None:
        self.mapping = mapping
        self.key = key
        self.number = number
        self.nodes = nodes
        self.children: list[int] = []
        self.asked: list[Asked] = []
        self.item = ""

    @property
    def span(self) -> Span:
        """Return the place of the kind's key."""
        return self.key_span(self.key)

    def has(self, key: str) -> bool:
        """Tell whether an option was written."""
        return key in self.mapping

    def key_span(self, key: str) -> Span:
        """Return the place of an option's key."""
        entry = self.mapping.entries.get(key)
        return entry.key.span if entry else self.mapping.span

    def scalar(self, key: str, what: str) -> Scalar | None:
        """Return an option that must be one word, number or text; None, and a finding, if it is not."""
        value = self.mapping.get(key)
        if isinstance(value, Scalar) and (value.text or not value.plain):
            return value
        if value is None or isinstance(value, Scalar):
            self.nodes.add(codes.MISSING.at(self.key_span(key), f"'{key}' needs {what}"))
            return None
        found = "a list" if isinstance(value, Sequence) else "a map"
        help_text = _FLOW_HELP if isinstance(value, Mapping) and what == "a condition" else ""
        self.nodes.add(codes.WRONG_SHAPE.at(value.span, f"'{key}' needs {what}, not {found}", help=help_text))
        return None

    def expression(self, key: str, wanted: Type, what: str) -> Expression:
        """Read an expression whose value must be of the type `wanted`."""
        scalar = self.scalar(key, what)
        return self._asked(scalar, wanted) if scalar else UNREADABLE

    def condition(self, key: str) -> Expression:
        """Read a condition."""
        return self.expression(key, FLAG, "a condition")

    def duration(self, key: str) -> Expression:
        """Read a duration."""
        return self.expression(key, quantity_of(TIME), "a duration, such as '5 s'")

    def count_or_forever(self, key: str) -> Expression | None:
        """Read a whole number; None stands for `forever`."""
        read = self.count_or(key, (FOREVER,))
        return None if isinstance(read, str) else read

    def count_or(self, key: str, words: tuple[str, ...]) -> Expression | str:
        """Read a whole number, or one of some words."""
        value = self.mapping.get(key)
        if isinstance(value, Scalar) and value.text in words:
            return value.text
        if isinstance(value, Scalar) and ENDLESS.get(value.text) in words:
            self.add(not_our_word(value, f"'{key}' cannot be '{value.text}'", ENDLESS))
            return FOREVER
        return self.expression(key, COUNT, f"a number or {' or '.join(repr(word) for word in words)}")

    def map_of(self, key: str, what: str) -> Mapping | None:
        """Return an option that must be a map with entries; None, and a finding, if it is not."""
        value = self.mapping.get(key)
        if isinstance(value, Mapping) and value.entries:
            return value
        self.add(codes.WRONG_SHAPE.at(self.key_span(key), f"'{key}' needs {what}"))
        return None

    def branch(self, key: str, branches: tuple[str, ...]) -> str:
        """Read the name of one of the branches."""
        scalar = self.scalar(key, "the name of a branch")
        if scalar and scalar.text not in branches:
            message = f"there is no branch '{scalar.text}'"
            self.add(codes.NOT_A_CHOICE.misspelt(scalar.span, message, scalar.text, branches, "its branches"))
        return scalar.text if scalar else ""

    def flag(self, key: str) -> bool:
        """Read `true` or `false`."""
        scalar = self.scalar(key, "'true' or 'false'")
        value = scalar and (plain_value(scalar) if scalar.filled is None else scalar.filled)
        if scalar and not isinstance(value, bool):
            self.add(not_our_word(scalar, f"'{key}' must be true or false", FLAGS))
        return value is True

    def choice(self, key: str, choices: tuple[str, ...]) -> str:
        """Read one of some words; the first one is the default."""
        if not self.has(key):
            return choices[0]
        scalar = self.scalar(key, " or ".join(f"'{choice}'" for choice in choices))
        if scalar and scalar.text not in choices:
            message = f"'{key}' cannot be '{scalar.text}'"
            self.nodes.add(codes.NOT_A_CHOICE.misspelt(scalar.span, message, scalar.text, choices, WORDS))
        return scalar.text if scalar else choices[0]

    def template(self, key: str) -> Template:
        """Read a text in which `$name` is filled in."""
        scalar = self.scalar(key, "a text")
        return self.template_of(scalar) if scalar else Template("", ())

    def template_of(self, scalar: Scalar) -> Template:
        """Return the text of a scalar with its slots."""
        try:
            template = parse_template(scalar.text)
        except ExpressionError as error:
            self.nodes.add(codes.NO_EXPRESSION.at(inner_span(scalar, error.start, error.end), error.message))
            return Template("", ())
        slots = (part for part in template.parts if isinstance(part, Slot))
        self.asked.extend(Asked(slot.value, UNKNOWN, _part_of(scalar, slot)) for slot in slots)
        return template

    def add(self, finding: Finding) -> None:
        """Keep a finding."""
        self.nodes.add(finding)

    def inside(self, mapping: Mapping, keys: Iterable[str], what: str) -> NodeReader:
        """Return a reader of a map below this node; keys that do not belong to it are findings."""
        for key, entry in mapping.entries.items():
            if key not in keys:
                message, of = f"unknown key '{key}' in {what}", f"keys of {what}"
                taken = mapping.entries
                self.add(codes.UNKNOWN_KEY.misspelt(entry.key.span, message, key, keys, of, taken=taken))
        return NodeReader(mapping, self.key, self.number, self.nodes)

    def name(self, key: str, what: str) -> Scalar:
        """Read a name; one without text, and a finding, if there is none."""
        scalar = self.scalar(key, what)
        return scalar if scalar and self.check_name(scalar) else Scalar("", self.key_span(key))

    def check_name(self, scalar: Scalar) -> bool:
        """Tell whether a word may be a name; a finding says it if not."""
        if not NAME.fullmatch(scalar.text):
            self.add(codes.WRONG_SHAPE.at(scalar.span, f"'{scalar.text}' is no name", help=NAME_HELP))
            return False
        return True

    def child_node(self, node: Node, step: str) -> None:
        """Read a node that belongs to this one."""
        self.children.append(self.nodes.child(node, step, self.number))

    def state(self, name: str, entry: Entry) -> None:
        """Read a state of a machine."""
        self.children.append(self.nodes.state(name, entry, self.number))

    def held(self, expression: Expression) -> None:
        """Read the nodes in the data that an expression may give."""
        self.children.extend(self.nodes.held(expression, self.number))

    def branches(self) -> tuple[str, ...]:
        """Read the branches of a parallel: a list, or a map, of which the names are returned."""
        value = self.mapping.get(self.key)
        if not isinstance(value, Mapping):
            self.steps()
            return ()
        if not value.entries:
            self.add(codes.MISSING.at(value.span, f"'{self.key}' needs at least one branch"))
        for name, entry in value.entries.items():
            self.check_name(entry.key)
            self.child_node(entry.value, name)
        return tuple(value.entries)

    def cases(self, key: str) -> tuple[Asked, ...]:
        """Read a map from values to nodes, and return the values in the order of the children."""
        value = self.map_of(key, "a map from values to what is done")
        if value is None:
            return ()
        read = []
        for name, entry in value.entries.items():
            expression = read_expression(entry.key, self.nodes)
            if expression is not None:
                read.append(Asked(expression, UNKNOWN, entry.key))
                self.child_node(entry.value, name)
        self.asked.extend(asked for asked in read if asked.expression.names)  # a bare word need be no place
        return tuple(read)

    def asked_later(self, mapping: Mapping, key: str) -> Asked | None:
        """Read a condition whose names only its kind knows, so that the kind has to check it."""
        reader = NodeReader(mapping, key, self.number, self.nodes)
        reader.condition(key)
        return reader.asked[0] if reader.asked else None

    def message(self, target: str, body: str) -> Message:
        """Read where a message goes, and what is in it."""
        scalar = self.scalar(target, "the name of a topic or a service")
        value = self.mapping.get(body)
        shape = None if value is None else self._shape(value)
        keys = {} if value is None else dict(_keys_of(value))
        return Message(scalar or Scalar("", self.key_span(target)), shape, keys)

    def moments(self, keys: Iterable[str]) -> Moments:
        """Read hooks: what is set, logged or published at some moments."""
        return Moments({key: self._deeds(key) for key in keys if self.has(key)})

    def _deeds(self, key: str) -> Deeds:
        value = self.map_of(key, "something small to do: 'set', 'log' or 'publish' below it")
        if value is None:
            return Deeds()
        inner = self.inside(value, (*DEEDS, *OPTIONS), f"'{key}'")
        for option, deed in OPTIONS.items():
            if inner.has(option) and not inner.has(deed):
                self.add(codes.UNKNOWN_KEY.at(inner.key_span(option), f"'{option}' belongs to '{deed}'"))
        deeds = Deeds(
            inner.assignments("set") if inner.has("set") else (),
            inner.template("log") if inner.has("log") else None,
            inner.choice("level", LEVELS),
            inner.message("publish", "message") if inner.has("publish") else None,
        )
        self.asked.extend(inner.asked)
        return deeds

    def _shape(self, node: Node) -> Shape:
        match node:
            case Mapping(entries=entries):
                return {name: self._shape(entry.value) for name, entry in entries.items()}
            case Sequence(items=items):
                return tuple(self._shape(item) for item in items)
            case Scalar():
                try:
                    expression = expression_of(node)
                except ExpressionError:
                    expression = None
                return Written(node, self._quiet_template(node), expression)

    def _quiet_template(self, scalar: Scalar) -> Template:
        try:
            return parse_template(scalar.text)
        except ExpressionError:
            return Template(scalar.text, (scalar.text,))

    def child(self, key: str) -> None:
        """Read the node under a key, which must be there."""
        value = self.mapping.get(key)
        if value is None or (isinstance(value, Scalar) and value.plain and not value.text):
            span = self.key_span(key) if value else self.span
            self.nodes.add(codes.MISSING.at(span, f"'{self.key}' needs '{key}': what is to be done"))
            return
        self.children.append(self.nodes.child(value, key, self.number))

    def steps(self) -> None:
        """Read the list that is the kind's value."""
        value = self.mapping.get(self.key)
        if isinstance(value, Sequence) and value.items:
            for index, item in enumerate(value.items):
                self.children.append(self.nodes.child(item, str(index), self.number))
        elif isinstance(value, Sequence):
            self.nodes.add(codes.MISSING.at(value.span, f"'{self.key}' needs at least one step"))
        else:
            self.nodes.add(codes.WRONG_SHAPE.at(self.span, f"'{self.key}' needs a list of steps"))

    def item_name(self) -> None:
        """Read the name that the nodes below give to a loop's item."""
        scalar = self.scalar(self.key, "a name for the item")
        if scalar and not NAME.fullmatch(scalar.text):
            bare = scalar.text[1:] if scalar.text.startswith("$") and NAME.fullmatch(scalar.text[1:]) else ""
            help_text = f"write '{bare}' without '$'" if bare else NAME_HELP
            fix = replacement(scalar.span, scalar.text, bare) if bare else None
            self.nodes.add(codes.WRONG_SHAPE.at(scalar.span, f"'{scalar.text}' is no name", help=help_text, fix=fix))
            self.item = scalar.text[1:] if NAME.fullmatch(scalar.text[1:]) else ""
        elif scalar:
            self.item = scalar.text

    def items(self, key: str) -> Expression | tuple[Expression, ...]:
        """Read a list that is written out, or an expression that gives one (of a map: its keys)."""
        value = self.mapping.get(key)
        if not isinstance(value, Sequence):
            expression = self.expression(key, UNKNOWN, "a list")
            self.nodes.loop(self.item, expression)
            return expression
        items = []
        for item in value.items:
            if isinstance(item, Scalar):
                items.append(self._asked(item, UNKNOWN))
            else:
                self.nodes.add(codes.WRONG_SHAPE.at(item.span, "an item must be a word, a number or '$name'"))
        return tuple(items)

    def assignments(self, key: str) -> tuple[Assignment, ...]:
        """Read a map from names of data to expressions."""
        value = self.mapping.get(key)
        if not isinstance(value, Mapping) or not value.entries:
            message = f"'{key}' needs a map of names and values"
            self.nodes.add(codes.WRONG_SHAPE.at(self.key_span(key), message, help="write the names below it, indented"))
            return ()
        inner = NodeReader(value, key, self.number, self.nodes)
        read: list[Assignment] = []
        for name, entry in value.entries.items():
            inner.expression(name, UNKNOWN, "a value")
            read.extend(Assignment(name, entry.key.span, asked) for asked in inner.asked[len(read) :])
        self.asked.extend(replace(asked, is_assigned=True) for asked in inner.asked)
        return tuple(read)

    def arguments(self) -> tuple[Argument, ...]:
        """Read the arguments of a skill: one value, or a map of several."""
        match self.mapping.get(self.key):
            case Mapping(entries=entries):
                return tuple(Argument(name, entry.value, entry.key.span) for name, entry in entries.items())
            case Scalar(text="", plain=True) | None:
                return ()
            case value:
                return (Argument("", value, value.span),)

    def _asked(self, scalar: Scalar, wanted: Type) -> Expression:
        expression = read_expression(scalar, self.nodes)
        if expression is None:
            return UNREADABLE
        self.asked.append(Asked(expression, wanted, scalar))
        return expression


NAME_HELP = "names begin with a small letter; small letters, digits and underscores follow"
_FLOW_HELP = "inside '{}', commas and colons divide: put quotes round the condition, or write it in block style"


def _keys_of(node: Node, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Span]]:
    """Yield the places of all keys of maps in maps, by their paths."""
    for name, entry in node.entries.items() if isinstance(node, Mapping) else ():
        yield (*path, name), entry.key.span
        yield from _keys_of(entry.value, (*path, name))


def _part_of(scalar: Scalar, slot: Slot) -> Scalar:
    return Scalar(f"${slot.path}", inner_span(scalar, slot.start, slot.end))
