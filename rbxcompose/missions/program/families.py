"""What the kinds of a family have in common, so that each answers only what is its own."""

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.base.expressions.check import StaticScope
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.expressions.types import Type
from rbxcompose.missions.program.answers import (
    NO_EFFECTS,
    PLAIN,
    Form,
    NodeEffects,
    NodeFlow,
    NodeLook,
    Possibility,
    Skipped,
    skipped,
    started,
)
from rbxcompose.missions.program.outcomes import Outcomes
from rbxcompose.missions.program.program import Endings, MissionNode, RobotNames, Step


def ends(outcomes: Outcomes) -> Any:
    """Return the `may_end` of a kind that may end in these ways wherever it is written."""

    def may_end(step: Step, node: MissionNode, endings: Endings) -> Outcomes:
        return outcomes

    return may_end


class LeafStep(Step):
    """A node without children: it does one thing once."""

    __slots__ = ()
    skipped = Skipped.NEVER
    comes_again = False
    flow = NodeFlow.IN_TURN
    look = PLAIN

    def endless(self, ends: Outcomes) -> None:
        """Return nothing: it runs once."""

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[Possibility]:
        """Yield nothing: the nodes around it cover whether it starts."""
        yield from ()

    def shows(self, node: MissionNode, scope: StaticScope) -> Mapping[str, Type]:
        """Return nothing: it has no children."""
        return {}

    @property
    def effects(self) -> NodeEffects:
        """Return no effects."""
        return NO_EFFECTS

    @property
    @abstractmethod
    def lasts(self) -> Expression | None:
        """Return the time that it takes, if the mission says so."""


class Deed(LeafStep):
    """A leaf that does something and ends immediately."""

    __slots__ = ()
    waits = False
    only_asks = False
    has_result = False
    lasts = None


class GroupStep(Step):
    """A node that does nothing by itself: its children do the work, and see what it sees."""

    __slots__ = ()

    @property
    def only_asks(self) -> bool:
        """Return False: it decides more than the answer to a condition."""
        return False

    def shows(self, node: MissionNode, scope: StaticScope) -> Mapping[str, Type]:
        """Return nothing: its children see what it sees."""
        return {}

    @property
    def waits(self) -> bool:
        """Return False: only its children take time."""
        return False

    @property
    def effects(self) -> NodeEffects:
        """Return no effects."""
        return NO_EFFECTS

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[Possibility]:
        """Yield nothing: there is one way through it, or how often it repeats depends on data."""
        yield from ()

    @property
    def has_result(self) -> bool:
        """Return False: only its children have results."""
        return False


class Straight(GroupStep):
    """A group that goes through its children once; tests need not see more of it than that."""

    __slots__ = ()

    @property
    def comes_again(self) -> bool:
        """Return False: it goes through its children once."""
        return False

    def endless(self, ends: Outcomes) -> None:
        """Return nothing: it runs once."""


class Loop(GroupStep):
    """A group that may repeat its children, or do nothing at all."""

    __slots__ = ()
    comes_again = True
    skipped = Skipped.PERHAPS


class Choosing(Straight):
    """A group that runs one of its children, or none."""

    __slots__ = ()
    skipped = Skipped.PERHAPS
    flow = NodeFlow.ONE_OF
    look = NodeLook(form=Form.BESIDE, has_roles=True)

    @property
    @abstractmethod
    def ways(self) -> tuple[str, ...]:
        """Return its alternatives in words, in the order of its children; the last may be that none of them runs."""

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[Possibility]:
        """Yield each child, and the case that nothing fits."""
        for index, word in enumerate(self.ways):
            if index < len(node.children):
                yield Possibility(node.span, f"{node.path}: {word}", started(node.children[index]))
            else:
                yield Possibility(node.span, f"{node.path}: nothing fits", skipped(node.number))
