"""Messages that a mission publishes, and requests that it makes, as written: the target, and each field's value."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import TypeAlias

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.text import Template
from rbxcompose.expressions.tree import Expression
from rbxcompose.findings import Span
from rbxcompose.manifest.tree import ScalarNode


@dataclass(frozen=True, slots=True)
class WrittenValue:
    """One value as written: a text with slots, and an expression if it can be parsed as one."""

    scalar: ScalarNode
    template: Template
    expression: Expression | None


TemplateShape: TypeAlias = "WrittenValue | Mapping[str, TemplateShape] | tuple[TemplateShape, ...]"


@dataclass(frozen=True, slots=True)
class MessageTemplate:
    """What is sent, and where; `body` is None for a message whose fields all keep their zero values.

    `keys` are the spans of the field names, by the path to each.
    """

    target: ScalarNode
    body: TemplateShape | None
    keys: Mapping[tuple[str, ...], Span] = field(default_factory=dict)

    @property
    def names(self) -> frozenset[str]:
        """Return all `$names` that it reads."""
        return frozenset(_names(self.body))


def _names(shape: TemplateShape | None) -> Iterator[str]:
    match shape:
        case WrittenValue():
            yield from (name.name for name in shape.template.names)
        case Mapping():
            for inner in shape.values():
                yield from _names(inner)
        case tuple():
            for inner in shape:
                yield from _names(inner)
