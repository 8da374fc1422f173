"""`fallback`: one node after the other, until one succeeds."""

from __future__ import annotations

from rbxcompose.missions.in_turn import OPTIONS, InTurn
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import SUCCESS


@kind("fallback", OPTIONS)
class Fallback(InTurn):
    """Try the nodes of a list in order; the first success is the fallback's own, a skipped one is passed over.

    Example:
        do:
          fallback:
            - check: distance($pose, dock) < 15 cm
            - go_to: dock
    """

    __slots__ = ()
    decides = SUCCESS
