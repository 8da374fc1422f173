"""Reads the values and options of one mission node; each kind reads its own."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Protocol

from rbxcompose.base.expressions.check import quotes_needed
from rbxcompose.base.expressions.text import Template, TextSlot, parse_template, refuse_foreign
from rbxcompose.base.expressions.tree import Expression, ExpressionError, Number
from rbxcompose.base.expressions.types import COUNT, FLAG, TEXT, UNKNOWN, Type, quantity_of
from rbxcompose.base.findings import Finding, Fix, Span, surely_meant
from rbxcompose.base.printable import plain
from rbxcompose.base.units import NUMBER, TIME, UnitError, parse_quantity
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode, plain_value
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import is_reported
from rbxcompose.missions.program import parts

NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")
NAME_HELP = "names start with a lower-case letter; lower-case letters, digits and underscores follow"
_BETWEEN = re.compile(r"[\s-]+")
_MOST_WORDS = 8  # of a name


def valid_name(text: str) -> str:
    """Return the name that a text was meant to be, `go_home` for `Go home`; empty if that is not clear."""
    meant = _BETWEEN.sub("_", text.strip()).lower()
    return meant if NAME.fullmatch(meant) else ""


def begun_step(words: list[str], kinds: Collection[str], skills: Collection[str]) -> tuple[str, list[str]]:
    """Return the step that some words begin with, `go_to` for `Go to the table`, and what stands behind it."""
    for count in range(min(len(words), _MOST_WORDS), 0, -1):
        name = valid_name(" ".join(words[:count]))
        if name in kinds or name in skills:
            if name == "wait_for" and words[count : count + 1] and words[count][0].isdigit():
                return "wait", words[count:]  # a time
            is_article = count > 1 and name in skills and words[count:][:1] == ["the"]
            return name, words[count + is_article :]
    return words[0], words[1:]


def invalid_name(scalar: ScalarNode, fix: Fix | None = None) -> Finding:
    """Return the finding on a text that is not a valid name."""
    meant = valid_name(scalar.text)
    help_text = f"write '{meant}': names have lower-case letters, digits and underscores" if meant else NAME_HELP
    return codes.WRONG_SHAPE.at(scalar.span, f"'{scalar.text}' is not a valid name", help=help_text, fix=fix)


FOREVER = "forever"
WORDS = "it can be"
_WORDS = re.compile(r"[^\W\d][\w'-]*+(?: (?!(?:and|or|not|in|is)\b)[^\W\d][\w'-]*+[.!?]?)+")  # several words of a text
# Replaces an expression that could not be read, so that the rest can be read nevertheless.
UNREADABLE = Expression("", Number(0, 0, 0.0, NUMBER))


class Nodes(Protocol):
    """The reader of the nodes below, which also keeps the findings."""

    def child(self, node: TreeNode, step: str, parent: int) -> int:
        """Read a node below `parent` and return its number; `step` is the next part of its path."""

    def state(self, name: str, entry: Entry, parent: int) -> int:
        """Read a state of the machine `parent` and return its number."""

    def loop(self, item: str, expression: Expression) -> None:
        """Note the item of a loop over the value of an expression."""

    def held(self, expression: Expression, parent: int, span: Span) -> list[int]:
        """Read the nodes in the data that an expression may yield, below `parent`, and return their numbers."""

    def add(self, finding: Finding) -> None:
        """Keep a finding."""


def read_expression(scalar: ScalarNode, nodes: Nodes, wanted: Type = FLAG) -> Expression | None:
    """Return the expression in a scalar; None, with a finding, if there is none. What is `wanted` is for the help."""
    try:
        return parts.expression_of(scalar)
    except ExpressionError as error:
        span = parts.inner_span(scalar, error.start, error.end) if scalar.text else scalar.span
        is_text = wanted in (TEXT, UNKNOWN) and _WORDS.fullmatch(scalar.text)
        help_text = _unit_help(scalar.text, wanted, error) or (quotes_needed(scalar.text) if is_text else "")
        nodes.add(codes.NO_EXPRESSION.at(span, error.message, help=help_text))
        return None


def _unit_help(text: str, wanted: Type, error: ExpressionError) -> str:
    """Return the help of an error; where the whole text is one quantity, its unit must fit what is wanted."""
    try:
        parse_quantity(text, wanted.dimension)
    except UnitError as wrong:
        if wanted.dimension and wrong.message == error.message:
            return wrong.help
    return error.help


_VALUE = "a value"
_HELP = {  # for names with values where something else is needed
    "a condition": "inside '{}', commas and colons separate: "
    "put quotes around the condition, or write it in block style",
    _VALUE: "give it a name under 'data', and write that: '$name'",
}


def _written(item: TreeNode) -> str:
    return "..." if not isinstance(item, ScalarNode) else item.text if item.plain else f'"{item.text}"'


def _part_of(scalar: ScalarNode, slot: TextSlot) -> ScalarNode:
    return ScalarNode(f"${slot.path}", parts.inner_span(scalar, slot.start, slot.end))


def unknown_keys(mapping: MappingNode, keys: Iterable[str], where: str, of: str = "") -> Iterator[Finding]:
    """Yield the findings on keys of a map that mean nothing there; `of` is what has these keys, if not that place."""
    for key, entry in mapping.entries.items():
        if key not in keys:
            message, what = f"unknown key '{key}' in {where}", f"keys of {of or where}"
            yield codes.UNKNOWN_KEY.misspelt(entry.key.span, message, key, keys, what, taken=mapping.entries)


class NodeReader:
    """Reads one mapping of a mission, with the nodes below it.

    `key` is the word of its kind, or the name of its skill.
    """

    def __init__(self, mapping: MappingNode, key: str, number: int, nodes: Nodes) -> None:
        self.mapping = mapping
        self.key = key
        self.number = number
        self.nodes = nodes
        self.children: list[int] = []
        self.item = ""
        self.asked: list[parts.Asked] = []
        self.names: tuple[str, ...] = ()  # of the branches

    @property
    def span(self) -> Span:
        """Return the place of the kind's key."""
        return self.key_span(self.key)

    def has(self, key: str) -> bool:
        """Return whether an option was written."""
        return key in self.mapping

    def key_span(self, key: str) -> Span:
        """Return the place of an option's key."""
        entry = self.mapping.entries.get(key)
        return entry.key.span if entry else self.mapping.span

    def scalar(self, key: str, what: str) -> ScalarNode | None:
        """Return an option that must be one word, number or text; None, with a finding, if it is not."""
        value = self.mapping.get(key)
        if is_reported(value):
            return None
        if isinstance(value, ScalarNode) and (value.text or not value.plain):
            return value
        if value is None or isinstance(value, ScalarNode):
            self.nodes.add(codes.MISSING.at(self.key_span(key), f"'{key}' needs {what}"))
            return None
        found = "a list" if isinstance(value, SequenceNode) else "names with values"
        help_text = _HELP.get(what, "") if isinstance(value, MappingNode) else ""
        if isinstance(value, SequenceNode) and what == _VALUE:
            help_text = f"put it in quotes: '[{plain(', '.join(map(_written, value.items)), 60)}]'"
        self.nodes.add(codes.WRONG_SHAPE.at(value.span, f"'{key}' needs {what}, not {found}", help=help_text))
        return None

    def expression(self, key: str, wanted: Type, what: str) -> Expression:
        """Read an expression whose value must be of the type `wanted`."""
        scalar = self.scalar(key, what)
        return self._asked(scalar, wanted) if scalar else UNREADABLE

    def condition(self, key: str) -> Expression:
        """Read a condition."""
        return self.expression(key, FLAG, "a condition")

    def watched(self, key: str) -> Expression:
        """Read a condition that is evaluated again and again while the node runs."""
        scalar = self.scalar(key, "a condition")
        return self._asked(scalar, FLAG, is_watched=True) if scalar else UNREADABLE

    def duration(self, key: str) -> Expression:
        """Read a duration."""
        return self.expression(key, quantity_of(TIME), "a duration, such as '5 s'")

    def count_or_forever(self, key: str) -> Expression | None:
        """Read a whole number; None means `forever`."""
        read = self.count_or(key, (FOREVER,))
        return None if isinstance(read, str) else read

    def count_or(self, key: str, words: tuple[str, ...]) -> Expression | str:
        """Read a whole number or one of the words."""
        value = self.mapping.get(key)
        if isinstance(value, ScalarNode) and value.text in words:
            return value.text
        return self.expression(key, COUNT, f"a number or {' or '.join(repr(word) for word in words)}")

    def flag(self, key: str) -> bool:
        """Read `true` or `false`."""
        scalar = self.scalar(key, "'true' or 'false'")
        value = scalar and (plain_value(scalar) if scalar.filled is None else scalar.filled)
        if scalar and not isinstance(value, bool):
            self.add(codes.NOT_A_CHOICE.at(scalar.span, f"'{key}' must be true or false"))
        return value is True

    def choice(self, key: str, choices: tuple[str, ...]) -> str:
        """Read one of the choices; the first one is the default."""
        if not self.has(key):
            return choices[0]
        scalar = self.scalar(key, " or ".join(f"'{choice}'" for choice in choices))
        if scalar and scalar.text not in choices:
            message = f"'{key}' cannot be '{scalar.text}'"
            found = codes.NOT_A_CHOICE.misspelt(scalar.span, message, scalar.text, choices, WORDS)
            is_sure = surely_meant(scalar.text, choices) is not None
            self.nodes.add(found if is_sure else replace(found, help=f"{WORDS}: {', '.join(choices)}"))
        return scalar.text if scalar else choices[0]

    def template(self, key: str) -> Template:
        """Read a text in which `$name` is filled in."""
        scalar = self.scalar(key, "a text")
        return self.template_of(scalar) if scalar else Template("", ())

    def template_of(self, scalar: ScalarNode) -> Template:
        """Return the text of a scalar with its slots."""
        try:
            refuse_foreign(scalar.text)
            template = parse_template(scalar.text)
        except ExpressionError as error:
            self.nodes.add(
                codes.NO_EXPRESSION.at(parts.inner_span(scalar, error.start, error.end), error.message, help=error.help)
            )
            return Template("", ())
        slots = (part for part in template.parts if isinstance(part, TextSlot))
        self.asked.extend(parts.Asked(slot.value, UNKNOWN, _part_of(scalar, slot)) for slot in slots)
        return template

    def add(self, finding: Finding) -> None:
        """Keep a finding."""
        self.nodes.add(finding)

    def name(self, key: str, what: str) -> ScalarNode:
        """Read a name; if there is none, return one without text, with a finding."""
        scalar = self.scalar(key, what)
        return scalar if scalar and self.check_name(scalar) else ScalarNode("", self.key_span(key))

    def check_name(self, scalar: ScalarNode) -> bool:
        """Return whether a word is a valid name; add a finding if not."""
        if not NAME.fullmatch(scalar.text):
            self.add(invalid_name(scalar))
            return False
        return True

    def _asked(self, scalar: ScalarNode, wanted: Type, *, is_watched: bool = False) -> Expression:
        expression = read_expression(scalar, self.nodes, wanted)
        if expression is None:
            return UNREADABLE
        self.asked.append(parts.Asked(expression, wanted, scalar, is_watched=is_watched))
        return expression

    def branch(self, key: str) -> ScalarNode | None:
        """Read the name of one of the branches."""
        branches = self.names
        scalar = self.scalar(key, "the name of a branch")
        if scalar and scalar.text not in branches:
            message = f"there is no branch '{scalar.text}'"
            self.add(codes.NOT_A_CHOICE.misspelt(scalar.span, message, scalar.text, branches, "its branches"))
        return scalar

    def map_of(self, key: str, what: str) -> MappingNode | None:
        """Return an option that must be a map with entries; None, with a finding, if it is not."""
        value = self.mapping.get(key)
        if isinstance(value, MappingNode) and value.entries:
            return value
        if not is_reported(value):
            self.add(codes.WRONG_SHAPE.at(self.key_span(key), f"'{key}' needs {what}"))
        return None

    def inside(self, mapping: MappingNode, keys: Iterable[str], what: str) -> NodeReader:
        """Return a reader of a map below this node; unknown keys are findings."""
        for finding in unknown_keys(mapping, keys, what):
            self.add(finding)
        return NodeReader(mapping, self.key, self.number, self.nodes)

    def child_node(self, node: TreeNode, step: str) -> None:
        """Read a child of this node."""
        self.children.append(self.nodes.child(node, step, self.number))

    def state(self, name: str, entry: Entry) -> None:
        """Read a state of a machine."""
        self.children.append(self.nodes.state(name, entry, self.number))

    def held(self, expression: Expression) -> None:
        """Read the nodes in the data that an expression may yield."""
        self.children.extend(self.nodes.held(expression, self.number, self.span))

    def branches(self, key: str) -> tuple[str, ...]:
        """Read the branches of a parallel, a list or a map, and return the names in a map."""
        value = self.mapping.get(key)
        if not isinstance(value, MappingNode):
            self._list(value)
            return ()
        if not value.entries:
            self.add(codes.MISSING.at(value.span, f"'{self.key}' needs at least one branch"))
        for name, entry in value.entries.items():
            self.check_name(entry.key)
            self.child_node(entry.value, name)
        self.names = tuple(value.entries)
        return self.names

    def cases(self, key: str) -> tuple[parts.Asked, ...]:
        """Read a map from values to nodes, and return the values in the order of the children."""
        value = self.map_of(key, "values below it, each with what is done then")
        if value is None:
            return ()
        read = []
        for name, entry in value.entries.items():
            expression = read_expression(entry.key, self.nodes)
            if expression is not None:
                read.append(parts.Asked(expression, UNKNOWN, entry.key))
                self.child_node(entry.value, name)
        self.asked.extend(asked for asked in read if asked.expression.names)  # a bare word need not be a place
        return tuple(read)

    def asked_later(self, mapping: MappingNode, key: str) -> parts.Asked | None:
        """Read a condition whose names only the kind knows; the kind has to check it."""
        reader = NodeReader(mapping, key, self.number, self.nodes)
        reader.condition(key)
        return reader.asked[0] if reader.asked else None

    def message(self, target: str, body: str) -> parts.MessageTemplate:
        """Read the target and the contents of a message."""
        scalar = self.scalar(target, "the name of a topic or a service")
        value = self.mapping.get(body)
        shape = None if value is None else self._shape(value)
        keys = {} if value is None else dict(_keys_of(value))
        return parts.MessageTemplate(scalar or ScalarNode("", self.key_span(target)), shape, keys)

    def moments(self, keys: Iterable[str]) -> parts.Moments:
        """Read hooks: what is set, logged or published at these moments."""
        return parts.Moments({key: self._deeds(key) for key in keys if self.has(key)})

    def _deeds(self, key: str) -> parts.Deeds:
        what = "an action: 'set', 'log' or 'publish' below it, without a dash"
        value = self.map_of(key, what)
        if value is None:
            return parts.Deeds()
        inner = self.inside(value, (*parts.DEEDS, *parts.OPTIONS), f"'{key}'")
        for option, deed in parts.OPTIONS.items():
            if inner.has(option) and not inner.has(deed):
                self.add(codes.UNKNOWN_KEY.at(inner.key_span(option), f"'{option}' belongs to '{deed}'"))
        deeds = parts.Deeds(
            inner.assignments("set") if inner.has("set") else (),
            inner.template("log") if inner.has("log") else None,
            inner.choice("level", parts.LEVELS),
            inner.message("publish", "message") if inner.has("publish") else None,
        )
        self.asked.extend(inner.asked)
        return deeds

    def _shape(self, node: TreeNode) -> parts.TemplateShape:
        match node:
            case MappingNode(entries=entries):
                return {name: self._shape(entry.value) for name, entry in entries.items()}
            case SequenceNode(items=items):
                return tuple(self._shape(item) for item in items)
            case ScalarNode():
                try:
                    expression = parts.expression_of(node)
                except ExpressionError:
                    expression = None
                return parts.WrittenValue(node, self._quiet_template(node), expression)

    def _quiet_template(self, scalar: ScalarNode) -> Template:
        try:
            return parse_template(scalar.text)
        except ExpressionError:
            return Template(scalar.text, (scalar.text,))

    def child(self, key: str) -> None:
        """Read the node under a key, which is required."""
        value = self.mapping.get(key)
        if value is None or (isinstance(value, ScalarNode) and value.plain and not value.text):
            span = self.key_span(key) if value else self.span
            self.nodes.add(codes.MISSING.at(span, f"'{self.key}' needs '{key}': what to do"))
            return
        self.children.append(self.nodes.child(value, key, self.number))

    def steps(self, key: str) -> None:
        """Read a list of nodes."""
        self._list(self.mapping.get(key))

    def _list(self, value: TreeNode | None) -> None:
        items = value.items if isinstance(value, SequenceNode) else ()
        for index, item in enumerate(items):
            self.child_node(item, str(index))
        if value and not items and not is_reported(value):
            self.add(codes.MISSING.at(value.span, f"'{self.key}' needs at least one step"))

    def item_name(self, key: str) -> str:
        """Read the name under which the nodes below see a loop's item."""
        scalar = self.scalar(key, "a name for the item")
        if scalar and self.check_name(scalar):
            self.item = scalar.text
        return self.item

    def items(self, key: str) -> Expression | tuple[Expression, ...]:
        """Read a literal list, or an expression that yields one (for a map: its keys)."""
        value = self.mapping.get(key)
        if not isinstance(value, SequenceNode):
            expression = self.expression(key, UNKNOWN, "a list")
            self.nodes.loop(self.item, expression)
            return expression
        items = []
        for item in value.items:
            if isinstance(item, ScalarNode):
                items.append(self._asked(item, UNKNOWN))
            else:
                self.nodes.add(codes.WRONG_SHAPE.at(item.span, "an item must be a word, a number or '$name'"))
        return tuple(items)

    def assignments(self, key: str) -> tuple[parts.Assignment, ...]:
        """Read a map from names of data to expressions."""
        value = self.mapping.get(key)
        if is_reported(value):
            return ()
        if not isinstance(value, MappingNode) or not value.entries:
            message = f"'{key}' needs names and their values"
            help_text = f"write 'name: value' on the line below '{key}:', further right and without a dash"
            self.nodes.add(codes.WRONG_SHAPE.at(self.key_span(key), message, help=help_text))
            return ()
        inner = NodeReader(value, key, self.number, self.nodes)
        read: list[parts.Assignment] = []
        for name, entry in value.entries.items():
            inner.expression(name, UNKNOWN, _VALUE)
            read.extend(parts.Assignment(name, entry.key.span, asked) for asked in inner.asked[len(read) :])
        self.asked.extend(replace(asked, is_assigned=True) for asked in inner.asked)
        return tuple(read)

    def inputs(self, key: str) -> tuple[parts.WrittenArgument, ...]:
        """Read the values for the inputs of another mission."""
        given = self.map_of(key, "a map from inputs to values")
        if given is None:
            span = self.key_span(key)
            return (parts.WrittenArgument("", ScalarNode("", span), span),)  # what is given could not be read
        return tuple(parts.WrittenArgument(name, entry.value, entry.key.span) for name, entry in given.entries.items())

    def record(self, key: str, what: str, keys: Mapping[str, str]) -> tuple[ScalarNode, ...]:
        """Read a map with these keys, each with what it needs; a scalar that is not there has no text."""
        mapping, empty = self.map_of(key, what), ScalarNode("", self.key_span(key))
        if mapping is None:
            return (empty,) * len(keys)
        inner = self.inside(mapping, keys, f"'{key}'")
        return tuple(inner.scalar(name, needs) or empty for name, needs in keys.items())

    def arguments(self) -> tuple[parts.WrittenArgument, ...]:
        """Read the arguments of a skill: one value, or a map of several."""
        match self.mapping.get(self.key):
            case MappingNode(entries=entries):
                return tuple(
                    parts.WrittenArgument(name, entry.value, entry.key.span) for name, entry in entries.items()
                )
            case ScalarNode(text="", plain=True) | None:
                return ()
            case value:
                return (parts.WrittenArgument("", value, value.span),)


def _keys_of(node: TreeNode, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Span]]:
    """Yield the places of all keys of maps in maps, by their paths."""
    for name, entry in node.entries.items() if isinstance(node, MappingNode) else ():
        yield (*path, name), entry.key.span
        yield from _keys_of(entry.value, (*path, name))
