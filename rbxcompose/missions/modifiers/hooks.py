"""Hooks: what is set, logged or published when a node starts or ends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from rbxcompose.missions.modifiers.registry import Modifier, modifier
from rbxcompose.missions.statuses import FAILURE, SUCCESS
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.moments import Moments
    from rbxcompose.missions.node_reader import NodeReader

ON_START, ON_SUCCESS, ON_FAILURE, ON_HALT = "on_start", "on_success", "on_failure", "on_halt"
_ON: Mapping[int, str] = {SUCCESS: ON_SUCCESS, FAILURE: ON_FAILURE}


@modifier(ON_START)
class Hooks(Modifier):
    """Do something small when the node starts or ends: `set`, `log`, `publish`.

    They run once per node, not per attempt, and see its result before `optional` and `invert`.

    Example:
        data:
          missed: 0
        do:
          go_to: corner_1
          on_start:
            log: Going to the first corner
          on_failure:
            set:
              missed: $missed + 1
    """

    __slots__ = ("moments",)
    keys = {
        ON_SUCCESS: "What is set, logged or published when the node succeeds.",
        ON_FAILURE: "What is set, logged or published when the node fails.",
        ON_HALT: "What is set, logged or published when the node is halted.",
    }

    def __init__(self, site: Site, options: Moments, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.moments = options

    @staticmethod
    def read(reader: NodeReader, key: str) -> Moments:
        """Read the hooks that are there."""
        return reader.moments((key, *Hooks.keys))

    def begin(self) -> int:
        """Do what belongs to the start."""
        self.moments.act(ON_START, self)
        return self.proceed()

    def proceed(self) -> int:
        """Go on, and do what belongs to the end."""
        status = self.advance(self.inner)
        if status in _ON:
            self.moments.act(_ON[status], self)
        return status

    def halt(self) -> None:
        """Stop what runs, and do what belongs to that."""
        super().halt()
        self.moments.act_safely(ON_HALT, self)

    def suspend(self, anew: bool) -> bool:
        """A node that begins anew is halted."""
        is_anew = super().suspend(anew)
        if is_anew:
            self.moments.act_safely(ON_HALT, self)
        return is_anew
