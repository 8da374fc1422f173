"""A setting that any node may have: how it is read, and what it changes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Self

from rbxcompose.expressions.tree import Expression
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.program.answers import Advice, Counted, ModifierScope
from rbxcompose.missions.program.moments import Moments
from rbxcompose.missions.program.outcomes import Outcomes


class Modifier(ABC):
    """A setting of a node, with its options; what is not abstract, only some modifiers have."""

    __slots__ = ()
    name: ClassVar[str]
    keys: ClassVar[Mapping[str, str]]  # keys beside its own, each with what it is for
    only_states: ClassVar[bool]  # it belongs to states of machines

    @classmethod
    @abstractmethod
    def read(cls, reader: NodeReader, key: str) -> Self:
        """Read the modifier's value."""

    @abstractmethod
    def changed(self, inner: Outcomes) -> Outcomes:
        """Return how a node may end with it; `inner` is how what is inside may."""

    @property
    @abstractmethod
    def may_skip(self) -> bool:
        """Return whether it may keep the node from starting."""

    @property
    @abstractmethod
    def serves(self) -> ModifierScope:
        """Return for which nodes it is there."""

    @property
    @abstractmethod
    def value(self) -> Expression | None:
        """Return the expression behind its key."""

    @property
    def said(self) -> str:
        """Return what is written behind its key where it is drawn."""
        return self.value.text if self.value else ""

    @property
    def repeats(self) -> bool:
        """Return whether it may start what is inside more than once."""
        return False

    @property
    def endless(self) -> Advice | None:
        """Return what to say if what is inside takes no time."""
        return None

    @property
    def numbers(self) -> tuple[Counted, ...]:
        """Return what it counts."""
        return ()

    @property
    def limit(self) -> Expression | None:
        """Return the time that the node may take."""
        return None

    @property
    def forgives(self) -> bool:
        """Return whether a failure may count as success."""
        return False

    @property
    def saved(self) -> ScalarNode | None:
        """Return the name under which the result is kept."""
        return None

    @property
    def moments(self) -> Moments | None:
        """Return what its hooks do."""
        return None
