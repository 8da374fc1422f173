"""`sequence`: one node after the other, until one fails."""

from __future__ import annotations

from rbxcompose.missions.program.answers import NodeFlow, NodeLook
from rbxcompose.missions.program.in_turn import RANDOM, InTurn, InTurnTask
from rbxcompose.missions.program.outcomes import FAILS, FAILURE, SUCCEEDS
from rbxcompose.missions.program.registry import kind


class SequenceTask(InTurnTask):
    """A list that ends at the first failure."""

    __slots__ = ()
    decides = FAILURE
    is_kept_after_failure = True


@kind("sequence", SequenceTask)
class SequenceStep(InTurn):
    """Do the nodes of a list in order, until one fails.

    Example:
        do:
          sequence:                       # a bare list is one too
            - go_to: dock
            - recharge
    """

    __slots__ = ()
    decides = FAILS
    flow = NodeFlow.IN_TURN
    look = NodeLook("→")

    @property
    def goes_on_after(self) -> str:
        """Return success."""
        return "" if self.order == RANDOM else SUCCEEDS
