"""Text arguments: `$name` and `$name.field` are filled in, `$$` is a dollar, everything else is text."""

import re
from collections.abc import Callable
from typing import TypeAlias

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.parser import NAME, parse
from rbxcompose.base.expressions.tree import Expression, ExpressionError, Reference
from rbxcompose.base.expressions.values import LONGEST_TEXT, EvaluationError, Scope, Value

Show: TypeAlias = Callable[[str, Value], str]
"""Formats the value of a name (`battery`, `result.count`) for people."""

_SLOT = re.compile(rf"\$(?:(?P<dollar>\$)|(?P<path>{NAME}(?:\.{NAME})*))")

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
        roots = ((slot, slot.path.partition(".")[0]) for slot in slots)
        return tuple(Reference(root, slot.start, slot.start + 1 + len(root)) for slot, root in roots)


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
