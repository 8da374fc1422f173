"""A setting that any node may have: how it is read, and what it changes."""

from abc import ABC, abstractmethod
from dataclasses import field
from typing import ClassVar, Self

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.language.fields import Declared
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.program.answers import Advice, ModifierScope, Moments
from rbxcompose.missions.program.outcomes import ALWAYS_SUCCEEDS, Outcomes
from rbxcompose.missions.program.sentences import deeds_in_words, spoken


class Modifier(Declared, ABC):
    """A setting of a node, with its options; only some modifiers override what is not abstract."""

    __slots__ = ()
    only_states: ClassVar[bool]  # it is for states of machines only

    @abstractmethod
    def changed(self, inner: Outcomes) -> Outcomes:
        """Return the outcomes of a node with this modifier; `inner` are those without it."""

    @property
    @abstractmethod
    def may_skip(self) -> bool:
        """Return whether it may keep the node from starting."""

    @property
    @abstractmethod
    def serves(self) -> ModifierScope:
        """Return which nodes it is meant for."""

    @property
    @abstractmethod
    def value(self) -> Expression | None:
        """Return the expression behind its key."""

    @abstractmethod
    def clause(self) -> str:
        """Return what it adds to the sentence of its node, read aloud: 'for at most 30 s'; empty for nothing."""

    @property
    def said(self) -> str:
        """Return the text to draw behind its key."""
        return self.value.text if self.value else ""

    @property
    def repeats(self) -> bool:
        """Return whether it may start the node inside more than once."""
        return False

    @property
    def endless(self) -> Advice | None:
        """Return the advice to give if the node inside takes no time."""
        return None

    @property
    def limit(self) -> Expression | None:
        """Return the time limit of the node."""
        return None

    @property
    def attempt_limit(self) -> Expression | None:
        """Return the time limit of each attempt."""
        return None

    @property
    def forgives(self) -> bool:
        """Return whether a failure may count as success."""
        return False

    @property
    def saved(self) -> ScalarNode | None:
        """Return the name under which the result is saved."""
        return None

    @property
    def moments(self) -> Moments | None:
        """Return what its hooks do."""
        return None


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

    def clause(self) -> str:
        """Say each hook: 'on failure, log 'Missed it''."""
        return "; ".join(f"{spoken(key)}, {deeds_in_words(deeds)}" for key, deeds in self.moments.deeds.items())

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
