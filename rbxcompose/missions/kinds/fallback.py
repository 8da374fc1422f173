"""`fallback`: one node after the other, until one succeeds."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.missions.program.answers import NodeFlow, NodeLook, Possibility, started
from rbxcompose.missions.program.in_turn import RANDOM, InTurn, InTurnTask
from rbxcompose.missions.program.outcomes import FAILS, SUCCEEDS, SUCCESS
from rbxcompose.missions.program.program import MissionNode, RobotNames
from rbxcompose.missions.program.registry import kind


class FallbackTask(InTurnTask):
    """A list that ends at the first success."""

    __slots__ = ()
    decides = SUCCESS


@kind("fallback", FallbackTask)
class FallbackStep(InTurn):
    """Try the nodes of a list in order, until one succeeds; skipped ones are passed over.

    Example:
        do:
          fallback:
            - check: distance($pose, dock) < 15 cm
            - go_to: dock
    """

    __slots__ = ()
    decides = SUCCEEDS
    flow = NodeFlow.ONE_OF
    look = NodeLook("?")

    @property
    def goes_on_after(self) -> str:
        """Return failure."""
        return "" if self.order == RANDOM else FAILS

    def possibilities(
        self, node: MissionNode, nodes: tuple[MissionNode, ...], robot: RobotNames
    ) -> Iterator[Possibility]:
        """Yield each node but the first, which is always tried."""
        for index, child in enumerate(node.children[1:], 2):
            yield Possibility(nodes[child].span, f"{node.path}: alternative {index}", started(child))
