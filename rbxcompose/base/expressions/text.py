"""Expressions and people: text arguments in which `$name` is filled in, and expressions in plain words."""

import re
from collections.abc import Callable
from typing import TypeAlias

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import tree
from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.parser import NAME, parse
from rbxcompose.base.expressions.tree import Expression, ExpressionError, Reference
from rbxcompose.base.expressions.values import LONGEST_TEXT, EvaluationError, Scope, Value

Show: TypeAlias = Callable[[str, Value], str]
"""Formats the value of a path (`battery`, `result.count`, `names[0]`) for people."""

_INDEX = rf"""\[(?:[0-9]+|\$?{NAME}|"[^"\[\]]*"|'[^'\[\]]*')\]"""  # any other text in brackets is plain text
_SLOT = re.compile(rf"\$(?:(?P<dollar>\$)|(?P<path>{NAME}(?:\.{NAME}|{_INDEX})*))")

_FOREIGN = re.compile(r"\{\{-?\s*[A-Za-z_$][^{}]*\}\}")  # of Jinja, as Home Assistant and Ansible have it
_SHOWN = 60


@dataclass(frozen=True, slots=True)
class TextSlot:
    """A slot in a text, from `start` to `end`, to be filled with the value of `path`."""

    path: str
    value: Expression
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Template:
    """A text with its slots; `parts` are in order."""

    text: str
    parts: tuple[str | TextSlot, ...]

    @property
    def names(self) -> tuple[Reference, ...]:
        """Return the names to fill in, without '$' and fields, with their positions."""
        slots = (part for part in self.parts if isinstance(part, TextSlot))
        found = ((slot.start, name) for slot in slots for name in slot.value.names)
        return tuple(Reference(name.name, start + name.start, start + name.end) for start, name in found)


def parse_template(text: str) -> Template:
    """Read a text argument.

    Raises:
        ExpressionError: if a name in it is longer or has more fields than an expression may have.
    """
    parts: list[str | TextSlot] = []
    end = 0
    for match in _SLOT.finditer(text):
        parts.append(text[end : match.start()])
        end = match.end()
        path = match["path"]
        parts.append(_slot(path, match.start(), end) if path else "$")
    parts.append(text[end:])
    return Template(text, tuple(part for part in parts if part))


def refuse_foreign(text: str) -> None:
    """Raise ExpressionError for a text with slots of another language: they would be read out as they are."""
    if found := _FOREIGN.search(text):
        help_text = "write '$name' or '$name.field' where its value belongs"
        raise ExpressionError(f"'{found[0][:_SHOWN]}' is not filled in", found.start(), found.end(), help_text)


def _slot(path: str, start: int, end: int) -> TextSlot:
    try:
        return TextSlot(path, parse(f"${path}"), start, end)
    except ExpressionError as error:
        raise ExpressionError(error.message, start, end) from None


def fill(template: Template, scope: Scope, show: Show) -> str:
    """Return the text with each value written by `show`.

    Raises:
        NotArrivedError: if a value has not arrived yet.
        EvaluationError: if there is no such value, or the text grows beyond its limit.
    """
    filled: list[str] = []
    left = LONGEST_TEXT
    for part in template.parts:
        filled.append(part if isinstance(part, str) else _filled(part, scope, show))
        left -= len(filled[-1])
        if left < 0:  # checked each time, since many long values would take time and memory
            raise EvaluationError(f"the text has more than {LONGEST_TEXT:,} characters", 0, len(template.text))
    return "".join(filled)


def _filled(slot: TextSlot, scope: Scope, show: Show) -> str:
    try:
        value = evaluate(slot.value, scope)
    except EvaluationError as error:
        raise EvaluationError(error.message, slot.start, slot.end) from None
    return show(slot.path, value)


_COMPARED = {"<": "is below", "<=": "is at most", ">": "is above", ">=": "is at least", "==": "is", "!=": "is not"}
_NOT = {"is below": "is at least", "is at most": "is above", "is": "is not"}
_NOT |= {other: word for word, other in _NOT.items()}
_COMPUTED = {"+": "plus", "-": "minus", "*": "times", "/": "divided by"}
_CALLED = {
    "count": "the number of {0}",
    "age": "the age of {0}",
    "distance": "the distance from {0} to {1}",
    "abs": "the absolute value of {0}",
    "round": "{0} rounded",
    "min": "the smallest of {all}",
    "max": "the largest of {all}",
}


def plain_name(name: str) -> str:
    """Return a name as people say it: without underscores."""
    return name.replace("_", " ")


def in_words(expression: tree.Expression) -> str:
    """Return an expression in words, with its units as they are written."""
    return _Speaker(expression.text).value(expression.tree)


def condition_in_words(expression: tree.Expression) -> str:
    """Return a condition in words, as they follow 'if'."""
    return _Speaker(expression.text).condition(expression.tree)


class _Speaker:
    """Says the parts of one text."""

    def __init__(self, text: str) -> None:
        self.text = text

    def condition(self, node: tree.ExpressionNode) -> str:
        match node:
            case tree.Comparison(operator=operator, left=left, right=right):
                return f"{self.value(left)} {_COMPARED[operator]} {self.value(right)}"
            case tree.Membership(item=item, group=tree.Items(items=items)):
                return f"{self.value(item)} is {self.several(items, 'or')}"
            case tree.Membership(item=item, group=group):
                return f"{self.value(item)} is in {self.value(group)}"
            case tree.Junction(operator=operator, operands=operands):
                return f" {operator} ".join(self.part(one, operator) for one in operands)
            case tree.Not(operand=operand):
                return self.contrary(operand)
            case tree.FunctionCall(function="new", arguments=(one, *_)):
                return f"{self.value(one)} is new"
            case tree.Flag() | tree.Word():
                return self.value(node)
        return f"{self.value(node)} is true"

    def contrary(self, node: tree.ExpressionNode) -> str:
        """Return the contrary of a condition."""
        match node:
            case tree.Comparison(operator=operator, left=left, right=right):
                return f"{self.value(left)} {_NOT[_COMPARED[operator]]} {self.value(right)}"
            case tree.Membership() | tree.Junction() | tree.Not():
                return f"it is not so that {self.condition(node)}"
            case tree.FunctionCall(function="new", arguments=(one, *_)):
                return f"{self.value(one)} is not new"
        return f"{self.value(node)} is not true"

    def part(self, node: tree.ExpressionNode, operator: str) -> str:
        """Return a part of a junction; one of another kind gets brackets, which no words replace."""
        words = self.condition(node)
        return f"({words})" if isinstance(node, tree.Junction) and node.operator != operator else words

    def several(self, items: tuple[tree.ExpressionNode, ...], last: str = "and") -> str:
        words = [self.value(item) for item in items]
        return f" {last} ".join([*([", ".join(words[:-1])] if words[:-1] else []), *words[-1:]]) or "nothing"

    def value(self, node: tree.ExpressionNode) -> str:
        match node:
            case tree.Number() | tree.Minus(operand=tree.Number()):
                return self.text[node.start : node.end]
            case tree.Text(value=value):
                return f"'{value}'"
            case tree.Flag(value=value):
                return "true" if value else "false"
            case tree.Variable(name=name):
                return f"the {plain_name(name)}"
            case tree.Word(name=name):
                return plain_name(name)
            case tree.Items(items=items):
                return self.several(items)
            case tree.FieldAccess(of=of, name=name):
                return f"{plain_name(name)} of {self.value(of)}"
            case tree.Index(of=of, index=index):
                is_number = isinstance(index, tree.Number)
                return f"{'item ' if is_number else ''}{self.value(index)} of {self.value(of)}"
            case tree.FunctionCall(function=function, arguments=arguments) if function in _CALLED:
                words = [self.operand(one) for one in arguments]
                return _CALLED[function].format(*words, *("" for _ in range(2)), all=self.several(arguments))
            case tree.Minus(operand=operand):
                return f"minus {self.value(operand)}"
            case tree.Arithmetic(operator=operator, left=left, right=right):
                return f"{self.operand(left)} {_COMPUTED[operator]} {self.operand(right)}"
        return self.condition(node)

    def operand(self, node: tree.ExpressionNode) -> str:
        """Return a part of a computation; one that is computed itself gets brackets."""
        return f"({self.value(node)})" if isinstance(node, tree.Arithmetic) else self.value(node)
