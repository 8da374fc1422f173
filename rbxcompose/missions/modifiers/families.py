"""What the modifiers of a family have in common, so that each only defines what is its own."""

from __future__ import annotations

from dataclasses import field
from typing import Self

from rbxcompose.base.dataclass import dataclass
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.program.answers import ModifierScope, Moments
from rbxcompose.missions.program.modifier import Modifier
from rbxcompose.missions.program.outcomes import ALWAYS_SUCCEEDS, Outcomes


class Plain(Modifier):
    """A modifier that changes nothing about how its node may end, and never keeps it from starting."""

    __slots__ = ()
    may_skip = False
    serves = ModifierScope.ALL

    def changed(self, inner: Outcomes) -> Outcomes:
        """Return the outcomes of the node inside."""
        return inner


@dataclass(frozen=True, slots=True)
class Acting(Plain):
    """A modifier whose keys are hooks."""

    moments: Moments = field()

    value = None

    @classmethod
    def read(cls, reader: NodeReader) -> Self:
        """Read the hooks that are present."""
        return cls(reader.moments(cls.fields))


class Skipping(Modifier):
    """A modifier that may keep its node from starting: the node is then skipped, which is no failure."""

    __slots__ = ()
    may_skip = True

    def changed(self, inner: Outcomes) -> Outcomes:
        """Return that it may also be skipped."""
        return inner.both(ALWAYS_SUCCEEDS)
