"""What people and viewers may ask of a robot's missions."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Command, Query, Refused

MISSION = "mission"
_SET, _FROM = "--set", "--from"

A = TypeVar("A")

Seen = Mapping[str, Any]
"""The state of a mission, as `Running.seen` returns it."""
PictureData = Mapping[str, Any]
"""A picture of a mission, as `picture_to_data` returns it."""


class _Command(Command):
    """A command about missions."""

    about = MISSION


class _Query(Query[A]):
    """A query about missions."""

    about = MISSION


@dataclass(frozen=True, slots=True)
class RunMission(_Command):
    """Start a mission, with inputs as text, in the state `start` of its machines if one is named."""

    mission: str
    inputs: Mapping[str, str] = field(default_factory=dict)
    start: str = ""
    is_repeated: bool = False
    """Whether a crash had cut it short: it may go on from its snapshot."""

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        inputs = [word for name, text in self.inputs.items() for word in (_SET, f"{name}={text}")]
        return shlex.join(["run", self.mission, *inputs, *([_FROM, self.start] if self.start else [])])


@dataclass(frozen=True, slots=True)
class _OfMission(_Command):
    """A command to a running mission; without a name, to the only one."""

    mission: str = ""

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        verb = type(self).__name__.removesuffix("Mission").lower()
        return shlex.join([verb, self.mission] if self.mission else [verb])


@dataclass(frozen=True, slots=True)
class CancelMission(_OfMission):
    """End a mission for good."""


@dataclass(frozen=True, slots=True)
class PauseMission(_OfMission):
    """Pause a mission; its timers stop."""


@dataclass(frozen=True, slots=True)
class ResumeMission(_OfMission):
    """Resume a paused mission."""


@dataclass(frozen=True, slots=True)
class RestoreMission(_OfMission):
    """Go on with a mission where it was when its process crashed or the machine lost power."""

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["resume", *([self.mission] if self.mission else []), "--from-snapshot"])


@dataclass(frozen=True, slots=True)
class ForgetMission(_OfMission):
    """Forget the run of a mission that a crash or a loss of power had cut short, so that nobody goes on with it."""


@dataclass(frozen=True, slots=True)
class StepMission(_OfMission):
    """Let a mission go on to the start of its next leaf, or to the next transition of a machine."""


def _in(mission: str) -> list[str]:
    return ["--mission", mission] if mission else []


class _InMission(_Command):
    """A command about what is in a mission, which may be named."""

    mission: str

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join([*(word.format(self) for word in self.written.split()), *_in(self.mission)])


@dataclass(frozen=True, slots=True)
class SetBreakpoint(_InMission):
    """Stop a mission at a node or a transition: `patrol.yaml:12`, a name, a state, `away->home`, or a number."""

    written = "break {0.where}"
    where: str
    mission: str = ""


@dataclass(frozen=True, slots=True)
class ClearBreakpoints(_Command):
    """Clear the breakpoint at `where`; without it, all of them."""

    where: str = ""
    mission: str = ""

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["break", *([self.where] if self.where else []), *_in(self.mission), "--clear"])


@dataclass(frozen=True, slots=True)
class ListedBreakpoint:
    """A breakpoint: the mission, how it was written, its file and line, and what is there.

    `spots` are the nodes that it concerns, by number, each with the outcome of the transition that is meant, if any.
    """

    mission: str
    where: str
    place: str
    text: str
    spots: tuple[tuple[int, str | None], ...] = ()


@dataclass(frozen=True, slots=True)
class ListBreakpoints(_Query[tuple[ListedBreakpoint, ...]]):
    """Query the list of breakpoints."""


@dataclass(frozen=True, slots=True)
class ForceNode(_InMission):
    """Halt a node that runs, and let it end with this outcome."""

    written = "force {0.where} {0.outcome}"
    where: str
    outcome: str
    mission: str = ""


@dataclass(frozen=True, slots=True)
class SetMissionData(_Command):
    """Set data of a mission that runs, given as text."""

    values: Mapping[str, str]
    mission: str = ""

    @property
    def words(self) -> str:
        """Return it as written on the command line."""
        return shlex.join(["set", *(f"{name}={text}" for name, text in self.values.items()), *_in(self.mission)])


@dataclass(frozen=True, slots=True)
class JumpMission(_InMission):
    """Let a machine that runs leave its state and enter this one."""

    written = "jump {0.state}"
    state: str
    mission: str = ""


OutcomesByNode = Mapping[str, Sequence[str]]
"""The outcomes in which nodes may end, by number as text."""


@dataclass(frozen=True, slots=True)
class ListOutcomes(_Query[OutcomesByNode]):
    """Query in which outcomes the nodes of a mission may be forced to end."""

    mission: str


@dataclass(frozen=True, slots=True)
class ListedDatum:
    """A datum of a mission that runs: what may be written for it, and what is now, as it would be written."""

    name: str
    about: str
    choices: tuple[str, ...]
    text: str | None
    """None if its value cannot be written, as a list of steps."""


@dataclass(frozen=True, slots=True)
class ListData(_Query[tuple[ListedDatum, ...]]):
    """Query the data of a mission that runs, as `SetMissionData` takes them."""

    mission: str


@dataclass(frozen=True, slots=True)
class ListedInput:
    """An input of a mission: what may be given in words, the words of a choice, and its default as it is written."""

    name: str
    about: str
    choices: tuple[str, ...] = ()
    default: str | None = None
    """None if it must be given."""


@dataclass(frozen=True, slots=True)
class ListedMission:
    """A mission of the robot, its state, the parts of the robot that it needs exclusively, and its inputs."""

    name: str
    about: str
    state: str
    claims: tuple[str, ...]
    inputs: tuple[ListedInput, ...] = ()
    starts: tuple[str, ...] = ()
    """The states in which it may start, if it is a machine."""
    at: str = ""
    """Where a breakpoint or a step has stopped it: file and line."""


@dataclass(frozen=True, slots=True)
class ListMissions(_Query[tuple[ListedMission, ...]]):
    """Query the list of missions."""


@dataclass(frozen=True, slots=True)
class ListedSnapshot:
    """A run that did not end since its process crashed or the machine lost power, from the snapshot that is left of it.

    `at` is the wall-clock time of the snapshot [s since the Unix epoch], `doing` what ran then, `inputs` what it was
    given, and `changed` what has changed since, so that it cannot go on. It `waits` if it is restored and paused.
    """

    mission: str
    at: float
    doing: str
    inputs: Mapping[str, str]
    changed: str = ""
    waits: bool = False


@dataclass(frozen=True, slots=True)
class ListSnapshots(_Query[tuple[ListedSnapshot, ...]]):
    """Query the runs that did not end and may go on."""


@dataclass(frozen=True, slots=True)
class ListedTrigger:
    """A trigger: its cause in words, when a wall clock shows its next time and showed its last start, if any.

    It waits if it has fired and missions that run are in the way of its own. `fired` is when it last did, also if it
    started nothing, and `came` what came of that. `off` is why it starts nothing now; empty if it does.
    """

    name: str
    mission: str
    cause: str
    priority: int
    running: str
    next: str = ""
    last: str = ""
    waits: bool = False
    fired: str = ""
    came: str = ""
    off: str = ""


@dataclass(frozen=True, slots=True)
class ListTriggers(_Query[tuple[ListedTrigger, ...]]):
    """Query the list of triggers."""


@dataclass(frozen=True, slots=True)
class ShowPicture(_Query[PictureData]):
    """Ask for the picture of a mission."""

    mission: str


@dataclass(frozen=True, slots=True)
class LookAtMission(_Query[Seen]):
    """Query what has changed in a mission since a version; 0 gives the full state."""

    mission: str
    since: int = 0


@dataclass(frozen=True, slots=True)
class LookAtAll(_Query[Seen]):
    """Query the full state of a mission, with its picture under `picture`, and its data for people under `shown`."""

    mission: str


@dataclass(frozen=True, slots=True)
class LogPart:
    """Records of the missions' log; `next` is how many were written so far."""

    next: int
    records: Sequence[Mapping[str, Any]]


@dataclass(frozen=True, slots=True)
class ReadLog(_Query[LogPart]):
    """Query the records of the log after the first `after`."""

    after: int = 0


def settings(lines: Sequence[str]) -> Mapping[str, str]:
    """Return inputs such as `rounds=2` by name.

    Raises:
        Refused: if there is no name or no `=`.
    """
    return dict(map(_setting, lines))


def _setting(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not name or not equals:
        raise Refused(f"'{text}' is not NAME=VALUE")
    return name, value
