"""What people may ask of the muxes of a running robot."""

from __future__ import annotations

import shlex

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Command, Query
from rbxcompose.base.units import TIME, format_quantity

MUX = "mux"
NONE = "__none"  # what is selected if nothing is, as topic_tools calls it


@dataclass(frozen=True, slots=True)
class MuxInputState:
    """An input of a mux: its `state` is `holds`, `waits`, `locked`, `must rest` or `silent`, its `why` in words."""

    name: str
    topic: str
    priority: int | None
    """None where priorities do not count."""
    state: str
    why: str = ""
    until: float | None = None
    """Robot time at which it counts as silent unless it sends again [s]; None for never."""
    silent_for: float | None = None
    """Time since its last message [s]; None before the first."""


@dataclass(frozen=True, slots=True)
class MuxLockState:
    """A lock of a mux; `why` says what engages it, and is empty if it is open."""

    name: str
    topic: str
    priority: int | None
    """None where priorities do not count."""
    why: str = ""


@dataclass(frozen=True, slots=True)
class MuxState:
    """What a mux does at a robot time [s]."""

    name: str
    output: str
    message: str
    mode: str
    profile: str
    time: float
    why: str
    """In words, who holds the output, or why nobody does."""
    holder: str | None = None
    until: float | None = None
    """Robot time at which the holder counts as silent unless it sends again [s]; None for never."""
    selected: str | None = None
    inputs: tuple[MuxInputState, ...] = ()
    locks: tuple[MuxLockState, ...] = ()


@dataclass(frozen=True, slots=True)
class MuxChange:
    """Who controls the output of a mux from a robot time on [s], in words; the numbers are consecutive."""

    number: int
    time: float
    text: str


@dataclass(frozen=True, slots=True)
class ReadMuxChanges(Query[tuple[MuxChange, ...]]):
    """Return the latest changes of a mux after a number."""

    about = MUX
    component: str
    after: int = 0


@dataclass(frozen=True, slots=True)
class LookAtMux(Query[MuxState]):
    """Return who holds the output of a mux and who waits."""

    about = MUX
    component: str


@dataclass(frozen=True, slots=True)
class SelectMuxInput(Command):
    """Let one input of a mux through, whose inputs are selected; `__none` for none."""

    about = MUX
    written = "mux select {0.component} {0.input}"
    component: str
    input: str


@dataclass(frozen=True, slots=True)
class AddMuxInput(Command):
    """Add an input to a mux until the robot goes down; without a topic, its topic is `<mux>/<input>`."""

    about = MUX
    component: str
    input: str
    topic: str = ""
    priority: int | None = None
    timeout: float | None = None

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        topic = ["--topic", self.topic] if self.topic else []
        priority = ["--priority", str(self.priority)] if self.priority is not None else []
        timeout = ["--timeout", format_quantity(self.timeout, TIME)] if self.timeout is not None else []
        return shlex.join(["mux", "add", self.component, self.input, *topic, *priority, *timeout])


@dataclass(frozen=True, slots=True)
class DeleteMuxInput(Command):
    """Remove an input from a mux until the robot goes down."""

    about = MUX
    written = "mux delete {0.component} {0.input}"
    component: str
    input: str


@dataclass(frozen=True, slots=True)
class LockMuxInputs(Command):
    """Hold inputs of a mux back by hand, all if none is named, for some `seconds` or until they are unlocked."""

    about = MUX
    component: str
    inputs: tuple[str, ...] = ()
    seconds: float | None = None

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        limit = ["--for", format_quantity(self.seconds, TIME)] if self.seconds is not None else []
        return shlex.join(["mux", "lock", self.component, *self.inputs, *limit])


@dataclass(frozen=True, slots=True)
class UnlockMuxInputs(Command):
    """End what was locked by hand: for these inputs, for all if none is named."""

    about = MUX
    component: str
    inputs: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["mux", "unlock", self.component, *self.inputs])
