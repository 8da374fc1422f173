"""What kinds of a family have in common, so that each answers only for itself."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping

from rbxcompose.expressions.check import StaticScope
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.types import Type
from rbxcompose.missions.program.answers import NodeFlow, Skipped
from rbxcompose.missions.program.look import PLAIN, Form, NodeLook
from rbxcompose.missions.program.moments import NO_EFFECTS, NodeEffects
from rbxcompose.missions.program.outcomes import Outcomes
from rbxcompose.missions.program.possible import Possibility, skipped, started
from rbxcompose.missions.program.program import MissionNode, RobotNames, Step


class LeafStep(Step):
    """A node with none inside: it does one thing once."""

    __slots__ = ()
    skipped = Skipped.NEVER
    comes_again = False
    flow = NodeFlow.IN_TURN
    look = PLAIN

    def endless(self, ends: Outcomes) -> None:
        """Say nothing: it is done once."""

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[Possibility]:
        """Yield nothing: whether it was started at all, the nodes around it tell."""
        yield from ()

    def shows(self, node: MissionNode, scope: StaticScope) -> Mapping[str, Type]:
        """Return nothing: there is none inside."""
        return {}

    @property
    @abstractmethod
    def lasts(self) -> Expression | None:
        """Return the time that it takes, if that is written down."""


class Deed(LeafStep):
    """A leaf that does something and has ended at once."""

    __slots__ = ()
    waits = False
    only_asks = False
    has_result = False
    lasts = None


class GroupStep(Step):
    """A node that does nothing by itself: what is done is done by those inside, which see what it sees."""

    __slots__ = ()

    @property
    def only_asks(self) -> bool:
        """Return that it decides more than an answer."""
        return False

    def shows(self, node: MissionNode, scope: StaticScope) -> Mapping[str, Type]:
        """Return nothing: those inside see what it sees."""
        return {}

    @property
    def waits(self) -> bool:
        """Return that only those inside take time."""
        return False

    @property
    def effects(self) -> NodeEffects:
        """Return that it has none."""
        return NO_EFFECTS

    @property
    def has_result(self) -> bool:
        """Return that only those inside have one."""
        return False


class Straight(GroupStep):
    """A group that goes once through what is inside; tests need not see more of it than that."""

    __slots__ = ()

    @property
    def comes_again(self) -> bool:
        """Return that it does not."""
        return False

    def endless(self, ends: Outcomes) -> None:
        """Say nothing: it is done once."""

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[Possibility]:
        """Yield nothing: there is one way through it."""
        yield from ()


class Loop(GroupStep):
    """A group that comes back to what is inside, or does nothing at all."""

    __slots__ = ()
    comes_again = True
    skipped = Skipped.PERHAPS

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[Possibility]:
        """Yield nothing: how often it comes back is a matter of data."""
        yield from ()


class Choosing(Straight):
    """A group that does one of its nodes, or none."""

    __slots__ = ()
    skipped = Skipped.PERHAPS
    flow = NodeFlow.ONE_OF
    look = NodeLook(form=Form.BESIDE, has_roles=True)

    @property
    @abstractmethod
    def ways(self) -> tuple[str, ...]:
        """Return its ways in words, in the order of its nodes; the last of them may be that nothing is done."""

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[Possibility]:
        """Yield each node, and that nothing fits."""
        for index, word in enumerate(self.ways):
            if index < len(node.children):
                yield Possibility(node.span, f"{node.path}: {word}", started(node.children[index]))
            else:
                yield Possibility(node.span, f"{node.path}: nothing fits", skipped(node.number))
