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
