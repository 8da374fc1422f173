"""`on_enter` and `on_exit` of states."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.missions.modifiers.registry import Modifier, modifier
from rbxcompose.missions.statuses import RUNNING
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.moments import Moments
    from rbxcompose.missions.node_reader import NodeReader

ON_ENTER, ON_EXIT = "on_enter", "on_exit"


@modifier(ON_ENTER)
class Entering(Modifier):
    """Do something small when a state is entered and when it is left: `set`, `log`, `publish`.

    Leaving also counts when something inside the mission halts the state, entering also when its history brings the
    machine back to it.

    Example:
        machine:
          start: away
          states:
            away:
              do:
                go_to: corner_1
              on_enter:
                log: Off we go
              on_exit:
                log: That was it
              next:
                success: finished
                failure: failed
    """

    __slots__ = ("moments",)
    keys = {ON_EXIT: "What is set, logged or published when the state is left."}
    only_states = True

    def __init__(self, site: Site, options: Moments, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.moments = options

    @staticmethod
    def read(reader: NodeReader, key: str) -> Moments:
        """Read what is there of the two."""
        return reader.moments((key, *Entering.keys))

    def begin(self) -> int:
        """Do what belongs to entering."""
        self.moments.act(ON_ENTER, self)
        return self.proceed()

    def proceed(self) -> int:
        """Go on, and do what belongs to leaving."""
        status = self.advance(self.inner)
        if status != RUNNING:
            self.moments.act(ON_EXIT, self)
        return status

    def suspend(self, anew: bool) -> bool:
        """An interrupt halts leaves, not states: the state stays entered, what is in it begins anew."""
        if self.current is not None and self.inner.suspend(anew):
            self.current = None
        return False

    def halt(self) -> None:
        """Stop what runs, and leave, unless the mission as a whole is ended from outside."""
        super().halt()
        if not self.engine.is_aborting:
            self.moments.act_safely(ON_EXIT, self)
