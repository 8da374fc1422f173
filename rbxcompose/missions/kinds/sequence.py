"""`sequence`: one node after the other, until one fails."""

from __future__ import annotations

from rbxcompose.missions.in_turn import OPTIONS, InTurn
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import FAILURE


@kind("sequence", OPTIONS)
class Sequence(InTurn):
    """Do the nodes of a list in order; the first failure is the sequence's own.

    Example:
        do:
          sequence:                       # a bare list is one too
            - go_to: dock
            - recharge
    """

    __slots__ = ()
    decides = FAILURE
    is_kept_after_failure = True
