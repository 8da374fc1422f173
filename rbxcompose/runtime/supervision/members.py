"""What the conductor knows about a robot's processes, and what it can do to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from enum import Enum, auto
from typing import Protocol

from rbxcompose.dataclass import dataclass
from rbxcompose.levels import Level
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.faults import RestartPolicy
from rbxcompose.runtime.host_report import HostReport
from rbxcompose.runtime.processes import KILLED


class ConductorEffects(Protocol):
    """What the conductor can do to the world."""

    run_id: str  # tells this start of the robot from any other

    def fork(self, process: str, *, is_restart: bool, is_stopped: bool) -> None:
        """Start a process."""
        ...

    def send(self, process: str, message: say.ChannelOrder) -> None:
        """Send a message to a process."""
        ...

    def to_hosts(self, report: HostReport) -> None:
        """Tell the other hosts of the robot how this one is."""
        ...

    def end(self, process: str) -> None:
        """End a process that does not listen yet, by SIGTERM."""
        ...

    def kill(self, process: str) -> None:
        """End a process, by SIGKILL."""
        ...

    def is_suspended(self, process: str) -> bool:
        """Return whether a signal keeps a process from running."""
        ...

    def waits(self, process: str | None) -> Mapping[str, float]:
        """Return how long each thread of a process has waited for a processor [s]; None is the supervisor itself."""
        ...

    def log(self, level: Level, text: str, detail: str = "") -> None:
        """Write a record of the whole robot."""
        ...

    def is_up(self) -> None:
        """Notify those who wait that everything is active."""
        ...

    def states_changed(self) -> None:
        """Mark the state that `ps` shows as changed, to be saved later."""
        ...

    def answer(self, number: int, answer: object) -> None:
        """Answer a request, with data."""
        ...

    def refuse(self, number: int, reason: str) -> None:
        """Refuse a request."""
        ...


class Phase(Enum):
    """The phase of the whole robot."""

    STARTING = auto()
    RUNNING = auto()
    BRAKING = auto()
    CLOSING = auto()
    ENDED = auto()


@dataclass
class Member:
    """The state of one process."""

    name: str
    is_there: bool = False
    is_configured: bool = False
    is_started: bool = False
    is_at_rest: bool = False
    is_told_lost: bool = False
    is_closing: bool = False
    is_stopped: bool = False  # as last sent to it
    is_given_up: bool = False  # it is gone, and nothing in it is ever restarted
    last_word: float = 0.0  # [s]
    killed_for: str = ""  # why it was killed, in words that follow its name
    restarts: int = 0
    moves: Sequence[str] = ()  # what moves the robot or is about to move it, in words
    runs: dict[str, str] = field(default_factory=dict)  # components whose work a restart would cut off -> that work
    requested: set[str] = field(default_factory=set)  # components that were ordered to become active
    policy: RestartPolicy = field(default_factory=RestartPolicy)

    def exited(self, how: str) -> str:
        """Note its end; return how it ended in words, with the reason if it was killed for one."""
        self.is_there = self.is_configured = False
        self.moves, self.runs = (), {}
        return self.killed_for if self.killed_for and how == KILLED else how

    def forked(self, now: float) -> None:
        """Reset the state for a newly forked process."""
        self.is_there, self.last_word = True, now
        self.is_configured = self.is_started = self.is_at_rest = self.is_told_lost = False
        self.moves, self.runs, self.killed_for = (), {}, ""
        self.requested.clear()
