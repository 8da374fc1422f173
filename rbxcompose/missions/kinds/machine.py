"""`machine`: states, and transitions between them by outcome."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.missions.events import Transition
from rbxcompose.missions.history import WithHistory
from rbxcompose.missions.machines import ENDS, STATE, MachineOptions, StateOptions
from rbxcompose.missions.registry import kind
from rbxcompose.missions.state_reading import read_machine, read_state
from rbxcompose.missions.statuses import FAILURE, NAMES, RUNNING, SKIPPED, SUCCESS
from rbxcompose.missions.task import NodeFailed, Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


@kind("machine")
class Machine(WithHistory):
    """Be in one state after the other; how a state's body ends decides which is next.

    Below it stand `start`, `states`, and perhaps `ends` and `history`. A state has `do` or `machine`, modifiers,
    `on_enter`, `on_exit`, and `next`. `finished` and `failed` are ends that always exist.

    Example:
        machine:
          start: away
          states:
            away:
              do:
                go_to: corner_1
              next:
                success: home
                failure: home
            home:
              do:
                go_to: dock
              next:
                success: finished
                failure: failed
    """

    __slots__ = ("index", "is_first", "options", "states")
    saved = ("index", "is_first")

    def __init__(self, site: Site, options: MachineOptions) -> None:
        super().__init__(site)
        self.options = options
        self.history = options.history
        self.states = site.children
        self.index = 0
        self.is_first = True  # it has not begun yet: it may be told in which state to do so

    @staticmethod
    def read(reader: NodeReader) -> MachineOptions:
        """Read the states and what stands beside them."""
        return read_machine(reader)

    def begin(self) -> int:
        """Enter the first state, or the one in which it was halted."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            start = self.options.start
            if self.is_first:
                start = self.engine.settings.start_at.get(self.number, start)
            self.index = self.options.states.index(start)
        self.is_first = False
        self.forget()
        return self.proceed()

    def proceed(self) -> int:
        """Go on with the state; the next one is for another tick."""
        self.engine.outcome = ""
        status = self.advance(self.states[self.index])
        if status == RUNNING:
            return RUNNING
        return self._go_on(SUCCESS if status == SKIPPED else status)

    def _go_on(self, status: int) -> int:
        name, counts_as = self.options.states[self.index], NAMES[status]
        outcome = self.engine.outcome or counts_as
        to = self._next(name, outcome, counts_as)
        self.engine.outcome = ""
        self.engine.say(Transition(self.number, name, outcome, to))
        if to in self.options.states:
            self.index = self.options.states.index(to)
            self.forget()
            self.engine.again(self)
            return RUNNING
        self.forget_places()
        ends = self.options.ends
        self.engine.outcome = to if to not in ENDS else ""
        return SUCCESS if ends[to] == NAMES[SUCCESS] else FAILURE

    def _next(self, state: str, outcome: str, counts_as: str) -> str:
        """Return where an outcome leads to: its own transition, else that of what it counts as."""
        options = self.engine.program.nodes[self.states[self.index].number].options
        leads = options.next.to if isinstance(options, StateOptions) and options.next else {}
        for key in (outcome, counts_as, ""):
            if key in leads:
                return leads[key]
        raise NodeFailed(f"state '{state}' ended with '{outcome}', which leads nowhere")


@kind(STATE, is_inner=True)
class State(Task):
    """The body of a state; its modifiers and hooks stand around it."""

    __slots__ = ("body",)

    def __init__(self, site: Site, options: StateOptions) -> None:
        super().__init__(site)
        self.body = site.children[0]

    @staticmethod
    def read(reader: NodeReader) -> StateOptions:
        """Read the body and where it leads to."""
        return read_state(reader)

    def begin(self) -> int:
        """Start the body."""
        return self.advance(self.body)

    def proceed(self) -> int:
        """Go on with the body."""
        return self.advance(self.body)

    def result(self) -> object:
        """Return what `save` keeps of the body."""
        return self.body.result()
