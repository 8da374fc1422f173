"""The channel between the supervisor and a process group: typed messages as lines of JSON over a socket pair."""

import contextlib
import socket
from dataclasses import field
from typing import Any, get_args

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Family
from rbxcompose.runtime.folder import ChosenLayers, ClockOffset
from rbxcompose.sdk.component import ComponentNoted, MissionOver, RobotHeld
from rbxcompose.sdk.parameters import ChangeRefusal, WantedChange


@dataclass(frozen=True, slots=True)
class RobotEnd:
    """The robot goes down as a whole: its exit code, and why."""

    exit_code: int
    reason: str


@dataclass(frozen=True, slots=True)
class StopMark:
    """One stop: the start of the share on which it was ordered, and its number there."""

    run: str
    number: int


@dataclass(frozen=True, slots=True)
class SharedStop:
    """What a host tells of stops: its own and who ordered it, those of others that it has released, and what holds it.

    `holds` are the reasons for which components of this host need the robot to stand still.
    """

    own: StopMark | None = None
    by: str = ""
    released: list[StopMark] = field(default_factory=list)
    holds: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class HostReport:
    """How one host is: `version` changes with the robot's files, `run` with each start of its share."""

    host: str
    version: str
    run: str
    is_going_down: bool = False
    stop: SharedStop = SharedStop()
    states: dict[str, str] = field(default_factory=dict)  # of its components
    end: RobotEnd | None = None
    clock: ClockOffset | None = None  # its clock against that of the host which hears it, which measures it


@dataclass(frozen=True, slots=True)
class PrepareChange:
    """Look whether components, by name, would accept new settings, and keep them for that; send `ChangePrepared`."""

    number: int
    wanted: WantedChange


@dataclass(frozen=True, slots=True)
class CommitChange:
    """Apply the settings that were prepared, for this change or when it was asked for, then send `ChangeFollowed`.

    With the number of an `AskForChange`, nothing else is to be applied elsewhere: once applied, it is decided and over.
    """

    number: int
    decides: int | None = None


@dataclass(frozen=True, slots=True)
class UndoChange:
    """Give components back the settings that they had before, then send `ChangeFollowed`."""

    number: int


@dataclass(frozen=True, slots=True)
class EndChange:
    """The change is over, done or not."""

    number: int


@dataclass(frozen=True, slots=True)
class ChangeDecided:
    """The answer to `AskForChange`: why it is not done, or nothing."""

    number: int
    refusal: ChangeRefusal | None


@dataclass(frozen=True, slots=True)
class AskRules:
    """For the judge: may components have the configurations of `new`, if others have those of `now`?

    Both are texts of configurations. Rules of another `generation` of the plan are made of the robot's files anew.
    """

    number: int
    generation: int
    file: str
    layers: ChosenLayers
    now: list[str]
    new: list[str]


@dataclass(frozen=True, slots=True)
class AskForChange:
    """Somebody wants to change settings of components, by their nodes; `ChangeDecided` carries the same number.

    With `new`, the process has prepared the change, since it has the only component that is concerned. `now` and `new`
    are those of `ChangePrepared`.
    """

    number: int
    wanted: WantedChange
    now: str = ""
    new: str = ""


@dataclass(frozen=True, slots=True)
class ChangePrepared:
    """Why components of the process would refuse a change, or nothing.

    `now` are those of its components whose settings are not those of the plan, `new` those that rules could notice, as
    they will be; both are texts of configurations, or empty.
    """

    number: int
    refusal: str
    now: str = ""
    new: str = ""


@dataclass(frozen=True, slots=True)
class ChangeFollowed:
    """Components have applied or taken back a change; else why one of them has not."""

    number: int
    refusal: str


@dataclass(frozen=True, slots=True)
class RulesSay:
    """The answer of the judge: which rule would be broken, or nothing."""

    number: int
    refusal: ChangeRefusal | None


ComponentSettingOrder = PrepareChange | CommitChange | UndoChange | EndChange | ChangeDecided
SettingOrder = ComponentSettingOrder | AskRules
SettingWord = AskForChange | ChangePrepared | ChangeFollowed | RulesSay


_CHUNK = 65536


@dataclass(frozen=True, slots=True)
class Configure:
    """Open the bus (at this router, if any) and configure all components; robot time [s] is `time` or later."""

    router: str | None
    time: float = 0.0


@dataclass(frozen=True, slots=True)
class Activate:
    """Activate these components."""

    names: list[str]


@dataclass(frozen=True, slots=True)
class Start:
    """The whole robot is active: missions may start, also that of `start` if it `starts_mission`; stepped time runs."""

    starts_mission: bool = True


@dataclass(frozen=True, slots=True)
class Stop:
    """Hold everything that moves until `Release`."""


@dataclass(frozen=True, slots=True)
class Release:
    """Allow motion again."""


@dataclass(frozen=True, slots=True)
class Brake:
    """Come to rest for good, then send `AtRest`."""


@dataclass(frozen=True, slots=True)
class Lost:
    """These components of another process are gone."""

    names: list[str]
    cause: str


@dataclass(frozen=True, slots=True)
class Ask:
    """A request to one component, as data; `Answered` or `Refusal` carries the same number."""

    number: int
    instance: str
    request: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Consider:
    """Ask the components of this plan, as text, how they would take it; `Considered` carries the same number."""

    number: int
    plan: str


@dataclass(frozen=True, slots=True)
class Adopt:
    """Before `Configure`: this plan, as text, replaces the one that the process was forked with."""

    plan: str


@dataclass(frozen=True, slots=True)
class Retire:
    """Bring these components to rest, in this order, and forget them; then send `Retired`."""

    names: list[str]


@dataclass(frozen=True, slots=True)
class Prepare:
    """Configure the components of this plan, as text, beside those that run; then send `Configured`."""

    plan: str


@dataclass(frozen=True, slots=True)
class Reconfigure:
    """Apply the settings in this plan, as text, to its components; then send `Reconfigured`.

    `keys` are the settings that have changed, by component; what `param set` did to others remains.
    """

    plan: str
    keys: dict[str, list[str]]


@dataclass(frozen=True, slots=True)
class Blocked:
    """The components of this process that cannot do their work, and why; all others can."""

    causes: dict[str, str]


@dataclass(frozen=True, slots=True)
class ToHosts:
    """For a router: tell the other hosts of the robot how this one is."""

    report: HostReport


@dataclass(frozen=True, slots=True)
class Shutdown:
    """Send `Summary`, deactivate, clean up and end."""


@dataclass(frozen=True, slots=True)
class Configured:
    """All components have been configured, or are being tried again; a router names its endpoint."""

    endpoint: str | None = None


@dataclass(frozen=True, slots=True)
class States:
    """Lifecycle states and numbers of restarts of components, by name."""

    states: dict[str, tuple[str, int]]


@dataclass(frozen=True, slots=True)
class StoppedByBus:
    """Somebody ordered this process, past the supervisor, to hold everything that moves."""


@dataclass(frozen=True, slots=True)
class AtRest:
    """Nothing moves any more after `Brake`."""


@dataclass(frozen=True, slots=True)
class Failed:
    """A component, or with no name the process itself, has failed for good; the robot cannot continue as it is."""

    instance: str
    message: str
    time: float = 0.0  # [s] of robot time


@dataclass(frozen=True, slots=True)
class Repeated:
    """These requests, as data, must be sent to a component again when its process was restarted."""

    instance: str
    requests: list[dict[str, Any]]


@dataclass(frozen=True, slots=True)
class SettingsKept:
    """The settings of a component as text, once they are not those of its plan: it gets them back after a restart of
    its process. With an empty text, they are those of the plan."""

    instance: str
    text: str


@dataclass(frozen=True, slots=True)
class TimeIsUp:
    """The time for which the robot was to run is over, on a stepped clock."""


@dataclass(frozen=True, slots=True)
class Answered:
    """The answer to an `Ask`, as data."""

    number: int
    answer: Any


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why an `Ask` was refused."""

    number: int
    reason: str


@dataclass(frozen=True, slots=True)
class Summary:
    """Facts for the summary at the end: robot time [s], and text by instance and label."""

    time: float
    facts: dict[str, dict[str, str]]


@dataclass(frozen=True, slots=True)
class Retired:
    """The components to retire are gone."""


@dataclass(frozen=True, slots=True)
class Reconfigured:
    """Components have applied their new settings, except those that `refused`, by name with the reason."""

    refused: dict[str, str]


@dataclass(frozen=True, slots=True)
class Considered:
    """What components say about a plan, and why some cannot take it."""

    number: int
    said: list[str]
    refused: list[str]


@dataclass(frozen=True, slots=True)
class Alive:
    """The loop of the process runs; its robot time [s], what moves the robot, and what its components are doing."""

    time: float
    moves: list[str] = field(default_factory=list)
    runs: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FromHost:
    """Another host of the robot has told how it is."""

    report: HostReport


LifecycleOrder = Configure | Activate | Start | Brake | Shutdown
PlanOrder = Consider | Adopt | Retire | Prepare | Reconfigure | SettingsKept
ChannelOrder = LifecycleOrder | Stop | Release | Lost | Blocked | Ask | PlanOrder | SettingOrder | ToHosts
KeptWord = Repeated | SettingsKept | ComponentNoted
ProgressWord = Configured | States | Failed | StoppedByBus | AtRest | TimeIsUp | Summary | Alive
AnswerWord = Answered | Refusal | Considered | Retired | Reconfigured
ChannelWord = ProgressWord | StoppedByBus | MissionOver | RobotHeld | KeptWord | AnswerWord | SettingWord | FromHost
ChannelMessage = ChannelOrder | ChannelWord

MESSAGES: Family[ChannelMessage] = Family(get_args(ChannelMessage))


@dataclass
class Channel:
    """One end of a socket pair. It never blocks: data not taken yet by the other side are kept for the next call."""

    connection: socket.socket
    is_open: bool = True
    _received: bytearray = field(default_factory=bytearray)
    _unsent: bytearray = field(default_factory=bytearray)

    def __post_init__(self) -> None:
        self.connection.setblocking(False)

    def fileno(self) -> int:
        """Return the descriptor to wait for."""
        return self.connection.fileno()

    def send(self, message: ChannelMessage) -> None:
        """Send a message; do nothing if the channel is closed."""
        if self.is_open:
            self._unsent += MESSAGES.to_line(message)
        self.flush()

    @property
    def is_behind(self) -> bool:
        """Return whether the other side has not taken everything; dispensable messages may then be left out."""
        return bool(self._unsent)

    def flush(self) -> None:
        """Send as much as possible of the unsent data."""
        try:
            while self.is_open and self._unsent:
                del self._unsent[: self.connection.send(self._unsent)]
        except BlockingIOError:
            return
        except (BrokenPipeError, ConnectionResetError):
            self.is_open = False

    def receive(self) -> list[ChannelMessage]:
        """Return the messages that have arrived; `is_open` becomes false when the other side has closed."""
        with contextlib.suppress(BlockingIOError):
            while self.is_open:
                chunk = self._read()
                self.is_open = bool(chunk)
                self._received += chunk
        *lines, rest = bytes(self._received).split(b"\n")
        self._received[:] = rest
        return [MESSAGES.from_line(line) for line in lines]

    def close(self) -> None:
        """Close this end."""
        self.is_open = False
        self.connection.close()

    def _read(self) -> bytes:
        try:
            return self.connection.recv(_CHUNK)
        except ConnectionResetError:
            return b""
