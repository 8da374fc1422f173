"""Reads the values and options of one mission node; each kind asks for what belongs to it."""

from __future__ import annotations

import re
from typing import Protocol

from rbxcompose.expressions.text import Slot, Template, parse_template
from rbxcompose.expressions.tree import Expression, ExpressionError, Number
from rbxcompose.expressions.types import COUNT, FLAG, UNKNOWN, Type, quantity_of
from rbxcompose.findings import Finding, Span, replacement
from rbxcompose.manifest.scalars import plain_value
from rbxcompose.manifest.tree import Mapping, Node, Scalar, Sequence
from rbxcompose.missions import codes
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
        value = self.mapping.get(key)
        if isinstance(value, Scalar) and value.text == FOREVER:
            return None
        return self.expression(key, COUNT, f"a number or '{FOREVER}'")

    def flag(self, key: str) -> bool:
        """Read `true` or `false`."""
        scalar = self.scalar(key, "'true' or 'false'")
        value = scalar and (plain_value(scalar) if scalar.filled is None else scalar.filled)
        if scalar and not isinstance(value, bool):
            self.nodes.add(codes.NOT_A_CHOICE.at(scalar.span, f"'{key}' must be true or false"))
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
            return self.expression(key, UNKNOWN, "a list")
        items = []
        for item in value.items:
            if isinstance(item, Scalar):
                items.append(self._asked(item, UNKNOWN))
            else:
                self.nodes.add(codes.WRONG_SHAPE.at(item.span, "an item must be a word, a number or '$name'"))
        return tuple(items)

    def assignments(self) -> tuple[Assignment, ...]:
        """Read a map from names of data to expressions."""
        value = self.mapping.get(self.key)
        if not isinstance(value, Mapping) or not value.entries:
            message = f"'{self.key}' needs a map of names and values"
            self.nodes.add(codes.WRONG_SHAPE.at(self.span, message, help="write the names below it, indented"))
            return ()
        inner = NodeReader(value, self.key, self.number, self.nodes)
        read: list[Assignment] = []
        for name, entry in value.entries.items():
            inner.expression(name, UNKNOWN, "a value")
            read.extend(Assignment(name, entry.key.span, asked) for asked in inner.asked[len(read) :])
        self.asked.extend(inner.asked)
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


def _part_of(scalar: Scalar, slot: Slot) -> Scalar:
    return Scalar(f"${slot.path}", inner_span(scalar, slot.start, slot.end))
