"""The parts of a mission as written: data, inputs, machines, messages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import TypeAlias

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.text import Template
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.expressions.types import Type
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.engine.resume_points import NO_HISTORY
from rbxcompose.missions.program.outcomes import FAILURE, NAMES, SUCCESS


@dataclass(frozen=True, slots=True)
class Datum:
    """A value as written: in SI, with its type and span."""

    value: Value
    type: Type
    span: Span


@dataclass(frozen=True, slots=True)
class Input:
    """A typed argument of a mission; without a default it must be given.

    With mistakes in its declaration it is not sound: it may have a default that could not be read.
    """

    name: str
    type: Type
    span: Span
    default: Datum | None = None
    least: float | None = None
    most: float | None = None
    is_sound: bool = True

    @property
    def must_be_given(self) -> bool:
        """Return whether it has no value unless one is given."""
        return self.default is None and self.is_sound


FINISHED, FAILED = "finished", "failed"
ENDS: Mapping[str, str] = {FINISHED: NAMES[SUCCESS], FAILED: NAMES[FAILURE]}  # those that always exist
STATE = "state"
MACHINE_KEYS = ("start", "states", "ends", "history")


@dataclass(frozen=True, slots=True)
class Next:
    """Where a state leads to, by outcome; the empty outcome covers all that are not named."""

    to: Mapping[str, str] = field(default_factory=dict)
    spans: Mapping[str, Span] = field(default_factory=dict)  # of the names of these states, by outcome
    keys: Mapping[str, Span] = field(default_factory=dict)  # of the outcomes

    def key_for(self, outcome: str, counts_as: str) -> str | None:
        """Return the key of the transition that an outcome takes: its own, or that of what it counts as."""
        for key in (outcome, counts_as, ""):
            if key in self.to:
                return key
        return None


@dataclass(frozen=True, slots=True)
class MachineStates:
    """The first state, the names of the states in the order of the children, the ends with their results."""

    start: str = ""
    names: tuple[str, ...] = ()
    ends: Mapping[str, str] = field(default_factory=dict)
    start_span: Span | None = None
    history: str = NO_HISTORY


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
