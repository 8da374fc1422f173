"""The data and the inputs of a mission, as written."""

from __future__ import annotations

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.types import Type
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Span


@dataclass(frozen=True, slots=True)
class Datum:
    """A value as written: in SI, with its type and span."""

    value: Value
    type: Type
    span: Span


@dataclass(frozen=True, slots=True)
class Input:
    """A typed argument of a mission; without a default it must be given."""

    name: str
    type: Type
    span: Span
    default: Datum | None = None
    least: float | None = None
    most: float | None = None
