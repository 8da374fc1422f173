"""The folder of a robot: lock, state, socket, log. It is this user's alone."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import stat
import tempfile
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path

from rbxcompose import __version__
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import TEMPORARY, open_regular, replace_file
from rbxcompose.base.requests import UnreadableError, from_data, to_data
from rbxcompose.runtime.processes import Process, boot_id


@dataclass(frozen=True, slots=True)
class ChosenLayers:
    """What was put over the robot's file when its plan was compiled: profiles, overlays by path, `--set`, `--real`."""

    profiles: tuple[str, ...] = ()
    overlays: tuple[str, ...] = ()
    sets: tuple[str, ...] = ()
    real: bool = False
    system: str = ""  # the file of the system that it belongs to, with the profiles of that
    system_profiles: tuple[str, ...] = ()
    member: str = ""  # its name there


NO_LAYERS = ChosenLayers()


@dataclass(frozen=True, slots=True)
class RunOptions:
    """Real time (`is_stepped` false) or stepped time at `rate` times real time (None: as fast as it goes).

    `duration` [s] of robot time ends the run; a robot that is detached stays up when its mission has ended.
    A stepped run can be recorded to the file `record` from within, so that each component can be replayed.
    """

    is_stepped: bool = False
    rate: float | None = None
    duration: float | None = None
    is_detached: bool = False
    record: Path | None = None
    layers: ChosenLayers = NO_LAYERS


SAMPLES = 40  # of ten seconds, in which the clocks of two computers drift by less than a millisecond
SET = 0.1  # [s] by which a clock is set rather than drifts
TOO_FAR = 0.02  # [s] between the clocks of two hosts: a robot at 0.5 m/s is then seen 1 cm from where it is


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """The clock of a host minus ours [s], and by how much this may be wrong [s]."""

    offset: float
    uncertainty: float

    @property
    def is_too_far(self) -> bool:
        """Return whether the clocks are surely too far apart."""
        return abs(self.offset) - self.uncertainty > TOO_FAR

    def differs_from(self, other: ClockOffset) -> bool:
        """Return whether a clock was surely set between the two."""
        return abs(self.offset - other.offset) > SET + self.uncertainty + other.uncertainty

    @property
    def words(self) -> str:
        """Return it for people: `3.2 ms ahead of ours (± 0.4 ms)`."""
        side = "ahead of" if self.offset > 0 else "behind"
        return f"{abs(self.offset) * 1e3:.1f} ms {side} ours (± {self.uncertainty * 1e3:.1f} ms)"


@dataclass(frozen=True, slots=True)
class Echo:
    """When the last report of a host was sent by its clock, and when it arrived by ours [ns since the epoch]."""

    sent: int
    arrived: int


class OffsetFilter:
    """Measures the clock of one host."""

    def __init__(self) -> None:
        self._samples: deque[ClockOffset] = deque(maxlen=SAMPLES)

    def feed(self, own: Echo, answer: Echo) -> ClockOffset | None:
        """Take when a report of ours was sent and arrived there, and when the answer was sent there and arrived here.

        Returns the best of the last measurements; None without any.
        """
        there, here = answer.sent - own.arrived, answer.arrived - own.sent  # both are positive times
        round_trip = here - there
        if round_trip >= 0:  # else a clock was set between the two
            offset = ((own.arrived - own.sent) + (answer.sent - answer.arrived)) / 2
            sample = ClockOffset(offset * 1e-9, round_trip * 1e-9 / 2)
            if self._samples and sample.differs_from(self._samples[-1]):
                self._samples.clear()
            self._samples.append(sample)
        return min(self._samples, key=lambda clock_offset: clock_offset.uncertainty, default=None)


STATE, LOCK, SOCKET = "state.json", "lock", "control.sock"
_BUS = "bus"
_STARTING = "starting.lock"  # shared by each `up` on its way; it stands beside the folders of robots
FINDINGS = "findings.json"
"""What `check` found when the robot came up, as `check --format json` writes it."""
MESSAGES = "messages.json"
"""The texts of the robot's own message types, by name: what guests on its bus need to read them."""
_VERSION = 1
_PASSING = (STATE, SOCKET, LOCK)  # files removed when the robot is down; the log stays
_LARGEST = 16_000_000  # [B] of a state
_LOCK_TRIES, _LOOKING = 5, 0.01  # [s] for which a check whether the lock is held may hold it


SUSPENDED = "suspended"
"""State in `ps` of a component whose process a signal keeps from running."""
SILENT = "silent"
"""State in `ps` of a component whose process gives no sign of life."""


class UnsafeFolderError(OSError):
    """Raised when the folder belongs to another user or is open to others."""


class BrokenStateError(ValueError):
    """Raised when the state file is corrupt."""


@dataclass(frozen=True, slots=True)
class ComponentState:
    """One line of `ps`."""

    name: str
    type: str
    state: str
    process: str
    pid: int | None
    restarts: int
    waits_for: str | None = None  # the failed component that it depends on
    note: str = ""  # what people should see of it


@dataclass(frozen=True, slots=True)
class Gauge:
    """Where a battery publishes its charge: the topic, the type of its messages, the unit of the number in them."""

    topic: str
    message: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class StopState:
    """A latched stop: who stopped the robot and at what robot time [s], and why `release` would be refused."""

    by: str
    time: float
    holds: Mapping[str, str]  # by component that needs the robot to stand still


@dataclass(frozen=True, slots=True)
class RobotState:
    """What is known about a robot from outside, even if its supervisor is dead."""

    robot: str
    file: str
    supervisor: Process
    processes: Mapping[str, Process]
    components: Sequence[ComponentState]
    router: str | None = None
    boot: str = ""
    domain: int = 0
    batteries: Mapping[str, Gauge] = field(default_factory=dict)  # by component
    executive: str | None = None  # the component that runs missions
    teleoperated: Mapping[str, str] = field(default_factory=dict)  # base -> topic that takes a person's commands
    layers: ChosenLayers = NO_LAYERS
    stop: StopState | None = None
    rest_time: float = 1.0  # [s] that it may take to come to rest when it goes down
    clocks: Mapping[str, ClockOffset] = field(
        default_factory=dict
    )  # of other hosts of the robot, against that of this one
    package_version: str = __version__  # of rbxcompose, as the supervisor runs it

    def to_text(self) -> str:
        """Return the text of the state file: a checksum, then JSON."""
        body = json.dumps({"version": _VERSION, **to_data(self)})
        return f"{_checksum(body)}\n{body}"

    @classmethod
    def from_text(cls, text: str) -> RobotState:
        """Read what `to_text` wrote.

        Raises:
            BrokenStateError: if the text is anything else.
        """
        checksum, _, body = text.partition("\n")
        if checksum != _checksum(body):
            raise BrokenStateError("its checksum is wrong")
        fields = json.loads(body)
        if fields.pop("version") != _VERSION:
            raise BrokenStateError("another version of rbxcompose wrote it")
        try:
            state: RobotState = from_data(cls, fields)
        except UnreadableError as error:
            raise BrokenStateError(f"another version of rbxcompose wrote it: {error}") from error
        return state

    def alive(self) -> dict[str, Process]:
        """Return its processes that still run, by name, except the supervisor."""
        return {name: process for name, process in self.processes.items() if self._is_ours(process)}

    @property
    def is_supervised(self) -> bool:
        """Return whether the supervisor still runs."""
        return self._is_ours(self.supervisor)

    def _is_ours(self, process: Process) -> bool:
        # A file alone must not decide what `down` ends: the process must have the title of one of this robot.
        return self.boot == boot_id() and process.is_running and process.is_titled(title(self.robot))


def title(robot: str, process: str = "") -> str:
    """Return the title of a robot's process in the system's `ps`; without a process name, the prefix of all titles."""
    return f"rbxcompose {robot}: {process}"


def _checksum(body: str) -> str:
    return hashlib.sha256(body.encode()).hexdigest()


def base_folder() -> Path:
    """Return the folder that holds the folders of all robots of this user."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return Path(runtime) / "rbxcompose" if runtime else Path(tempfile.gettempdir()) / f"rbxcompose-{os.getuid()}"


def made_base() -> Path:
    """Return the folder that holds the folders of all robots, which is made if there is none.

    Raises:
        UnsafeFolderError: if it belongs to another user or is open to others.
    """
    base = base_folder()
    base.mkdir(mode=0o700, parents=True, exist_ok=True)
    _require_private(base)
    return base


def system_record(path: str) -> Path:
    """Return the file that keeps where the robots of a system were brought up, whose own file is at `path`.

    It stands beside the folders of robots, whose names have no dot.
    """
    return base_folder() / f"{hashlib.sha256(os.path.realpath(path).encode()).hexdigest()[:32]}.system"


def mark_start(*, is_over: bool = False) -> None:
    """Note for `is_starting` that this process is about to bring robots up, until it ends or the start `is_over`."""
    with contextlib.suppress(OSError):  # what is wrong with the folder is reported where the robot starts
        descriptor = os.open(made_base() / _STARTING, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        fcntl.lockf(descriptor, fcntl.LOCK_SH)  # of this process alone: a supervisor that it forks does not hold it
        if is_over:
            os.close(descriptor)  # this releases it, by whichever descriptor it was locked


def is_starting() -> bool:
    """Return whether another process of this user is about to bring up robots whose folders may not be known yet."""
    try:
        with open(base_folder() / _STARTING, "rb+") as file:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return isinstance(error, BlockingIOError)
    return False


def all_folders() -> list[RobotFolder]:
    """Return the folders of all robots that are up or were left behind, by name.

    Raises:
        UnsafeFolderError: if the folder above them belongs to another user or is open to others.
    """
    base = base_folder()
    try:
        _require_private(base)
    except FileNotFoundError:
        return []
    # Any of these files may have been removed while the robot runs.
    names = {path.parent.name for mark in _PASSING for path in base.glob(f"*/{mark}")}
    return [folder for name in sorted(names) if (folder := RobotFolder(base / name)).is_known]


def _require_private(folder: Path) -> None:
    """Refuse a folder that others may have written to.

    Raises:
        FileNotFoundError: if it does not exist.
        UnsafeFolderError: if it belongs to another user, is open to others, or is not a folder.
    """
    try:
        found = os.lstat(folder)
    except PermissionError as error:
        raise UnsafeFolderError(f"{folder} cannot be opened: it belongs to another user") from error
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) & 0o077:
        raise UnsafeFolderError(f"{folder} must be a folder of this user that nobody else can open (mode 0700)")


@dataclass(frozen=True, slots=True)
class RobotFolder:
    """Paths and files of one robot."""

    path: Path

    @classmethod
    def of(cls, robot: str) -> RobotFolder:
        """Return the folder of a robot by its name; it need not exist."""
        return cls(base_folder() / robot)

    def make(self) -> None:
        """Create the folder if it does not exist.

        Raises:
            UnsafeFolderError: if it, or the one above, belongs to another user or is open to others.
        """
        for folder in (self.path.parent, self.path, self.sockets):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            _require_private(folder)

    @property
    def sockets(self) -> Path:
        """Return the folder of the sockets by which its processes talk, if only this user may."""
        return self.path / _BUS

    @property
    def is_known(self) -> bool:
        """Return whether a robot is up here or has left its state behind."""
        return (self.path / STATE).exists() or self.is_held

    @property
    def is_held(self) -> bool:
        """Return whether a process holds the lock."""
        try:
            descriptor = os.open(self.path / LOCK, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
        except OSError:
            return False
        try:
            fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        finally:
            os.close(descriptor)
        return False

    def has_lost(self, lock: int) -> bool:
        """Return whether somebody has removed files of a running robot, which holds `lock`."""
        return not (self.has_lock(lock) and all((self.path / name).exists() for name in (STATE, SOCKET, _BUS)))

    def lock(self) -> int | None:
        """Return a descriptor that holds the lock until it is closed, or None if someone else holds it."""
        tries = _LOCK_TRIES
        while True:
            descriptor = os.open(self.path / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(descriptor)
                tries -= 1
                if not tries:
                    return None
                time.sleep(_LOOKING)
                continue
            if self.has_lock(descriptor):
                return descriptor
            os.close(descriptor)  # its previous holder removed it

    def has_lock(self, lock: int) -> bool:
        """Return whether a lock that is held is the one that others would try to hold."""
        try:
            return os.path.samestat(os.fstat(lock), os.stat(self.path / LOCK))
        except FileNotFoundError:
            return False

    def read_state(self) -> RobotState | None:
        """Return the state, or None if there is none.

        Raises:
            BrokenStateError: if the file is corrupt, or another user may have written it.
        """
        try:
            file = open_regular(self.path / STATE, follow=False)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise BrokenStateError(error.strerror) from error
        with file:
            found = os.fstat(file.fileno())
            if found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) & 0o077:
                raise BrokenStateError("another user may have written it")
            text = file.read(_LARGEST)  # if the file is cut off here, its checksum differs
        try:
            return RobotState.from_text(text.decode())
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise error if isinstance(error, BrokenStateError) else BrokenStateError("it has another form") from error

    def write_state(self, state: RobotState) -> None:
        """Replace the state file atomically, whatever happens meanwhile."""
        replace_file(self.path / STATE, state.to_text().encode(), mode=0o600)

    def write_findings(self, text: str) -> None:
        """Keep what `check` found."""
        replace_file(self.path / FINDINGS, text.encode(), mode=0o600)

    def write_messages(self, texts: Mapping[str, str]) -> None:
        """Keep the texts of the robot's own message types."""
        replace_file(self.path / MESSAGES, json.dumps(dict(texts)).encode(), mode=0o600)

    def read_messages(self) -> dict[str, str]:
        """Return the texts of the robot's own message types; none if they cannot be read."""
        try:
            with open_regular(self.path / MESSAGES, follow=False) as file:
                read = json.loads(file.read(_LARGEST))
        except (OSError, ValueError):
            return {}
        return {str(name): str(text) for name, text in read.items()} if isinstance(read, dict) else {}

    def sweep(self) -> None:
        """Remove what a killed run has left: temporary files, outputs, its socket. Needs the lock."""
        for path in self._leftovers():
            path.unlink(missing_ok=True)

    def clear(self) -> None:
        """Remove everything but the log. Needs the lock, which is removed last."""
        self.sweep()
        with contextlib.suppress(OSError):  # somebody has put something into it, or removed it
            self.sockets.rmdir()
        for name in _PASSING:
            (self.path / name).unlink(missing_ok=True)

    def _leftovers(self) -> Iterator[Path]:
        yield from self.path.glob(f"*{TEMPORARY}")
        yield from self.path.glob("*.out")
        yield from self.sockets.glob("*")
        yield self.path / SOCKET
        yield self.path / FINDINGS
        yield self.path / MESSAGES
