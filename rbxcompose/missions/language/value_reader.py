"""Reads single values of a mission node: expressions, counts, flags, choices, texts, names."""

import re
from dataclasses import replace
from typing import Protocol

from rbxcompose.base.expressions.check import quotes_needed
from rbxcompose.base.expressions.text import Template, TextSlot, parse_template, refuse_foreign
from rbxcompose.base.expressions.tree import Expression, ExpressionError, Number
from rbxcompose.base.expressions.types import COUNT, FLAG, TEXT, UNKNOWN, Type, quantity_of
from rbxcompose.base.findings import Finding, Fix, Span, surely_meant
from rbxcompose.base.units import NUMBER, TIME
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode, plain_value
from rbxcompose.missions import codes
from rbxcompose.missions.language.asked import Asked, expression_of, inner_span
from rbxcompose.missions.language.grammar import is_reported

NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")
NAME_HELP = "names start with a lower-case letter; lower-case letters, digits and underscores follow"
_BETWEEN = re.compile(r"[\s-]+")


def valid_name(text: str) -> str:
    """Return the name that a text was meant to be, `go_home` for `Go home`; empty if that is not clear."""
    meant = _BETWEEN.sub("_", text.strip()).lower()
    return meant if NAME.fullmatch(meant) else ""


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
        ...

    def state(self, name: str, entry: Entry, parent: int) -> int:
        """Read a state of the machine `parent` and return its number."""
        ...

    def loop(self, item: str, expression: Expression) -> None:
        """Note the item of a loop over the value of an expression."""
        ...

    def held(self, expression: Expression, parent: int, span: Span) -> list[int]:
        """Read the nodes in the data that an expression may yield, below `parent`, and return their numbers."""
        ...

    def add(self, finding: Finding) -> None:
        """Keep a finding."""
        ...


def read_expression(scalar: ScalarNode, nodes: Nodes, wanted: Type = FLAG) -> Expression | None:
    """Return the expression in a scalar; None, with a finding, if there is none. What is `wanted` is for the help."""
    try:
        return expression_of(scalar)
    except ExpressionError as error:
        span = inner_span(scalar, error.start, error.end) if scalar.text else scalar.span
        is_text = wanted in (TEXT, UNKNOWN) and _WORDS.fullmatch(scalar.text)
        help_text = error.help or (quotes_needed(scalar.text) if is_text else "")
        nodes.add(codes.NO_EXPRESSION.at(span, error.message, help=help_text))
        return None


class ValueReader:
    """The values of one mapping of a mission: `key` is the word of its kind, or the name of its skill."""

    def __init__(self, mapping: MappingNode, key: str, nodes: Nodes) -> None:
        self.mapping = mapping
        self.key = key
        self.nodes = nodes
        self.asked: list[Asked] = []
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
        help_text = _FLOW_HELP if isinstance(value, MappingNode) and what == "a condition" else ""
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
                codes.NO_EXPRESSION.at(inner_span(scalar, error.start, error.end), error.message, help=error.help)
            )
            return Template("", ())
        slots = (part for part in template.parts if isinstance(part, TextSlot))
        self.asked.extend(Asked(slot.value, UNKNOWN, _part_of(scalar, slot)) for slot in slots)
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
        self.asked.append(Asked(expression, wanted, scalar, is_watched=is_watched))
        return expression

    def branch(self, key: str) -> ScalarNode | None:
        """Read the name of one of the branches."""
        branches = self.names
        scalar = self.scalar(key, "the name of a branch")
        if scalar and scalar.text not in branches:
            message = f"there is no branch '{scalar.text}'"
            self.add(codes.NOT_A_CHOICE.misspelt(scalar.span, message, scalar.text, branches, "its branches"))
        return scalar


_FLOW_HELP = "inside '{}', commas and colons separate: put quotes around the condition, or write it in block style"


def _part_of(scalar: ScalarNode, slot: TextSlot) -> ScalarNode:
    return ScalarNode(f"${slot.path}", inner_span(scalar, slot.start, slot.end))
