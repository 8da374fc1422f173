"""What monitors of this computer share: how much is in use, its batteries, its clock."""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, ClassVar, TypeVar

from pydantic import Field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.limits import LimitCore, Limits
from rbxcompose.sdk import Capability, Component, Config, Live, NeedsExtra, Ratio, Setting, Time, Warns

C = TypeVar("C", bound=Config)
NEEDS_PSUTIL = NeedsExtra(Setting("psutil"), Setting("monitors"))
FOLDER = Path("/sys/class/power_supply")
MICRO = 1e-6
PORT = 123
SIZE = 48  # [bytes] of a packet
ERA = 2_208_988_800  # [s] from the beginning of NTP's time, 1900, to that of Unix
_HEADER = struct.Struct("!BBbb11I")
_CLIENT = 0x23  # version 4, mode 3
_SERVER = 4  # mode
_UNSYNCHRONISED = 3  # leap indicator
_FRACTION = 2**32
HYSTERESIS = 0.02  # of the share


class HostMonitor(Component[C]):
    """Measures once a second; in simulated time it does not, so that two runs are alike."""

    rate: ClassVar[float] = 1.0

    def measure(self, dt: float) -> None:
        """Look at the computer, `dt` [s] after the last time, and report."""
        raise NotImplementedError

    def step(self, dt: float) -> None:
        """Measure."""
        if self.context.clock.is_real:
            self.measure(dt)
        else:
            self.status(Level.OK, "not measured: time is simulated")


@dataclass(frozen=True, slots=True)
class Supply:
    """A battery: `charge` and `health` from 0 to 1, None where Linux does not know; [V], [A]."""

    name: str
    status: str
    charge: float | None
    health: float | None
    voltage: float | None
    current: float | None


def batteries(folder: Path = FOLDER) -> tuple[Supply, ...]:
    """Return the batteries that are present, by name; none where there is no such folder.

    Batteries of devices, such as a mouse, have the scope `Device` and do not count.
    """
    try:
        found = sorted(folder.iterdir())
    except OSError:
        return ()
    return tuple(_supply(path) for path in found if _is_own_battery(path))


def _is_own_battery(folder: Path) -> bool:
    is_battery = _text(folder, "type") == "Battery" and _text(folder, "scope") != "Device"
    return is_battery and _text(folder, "present") != "0"


def _supply(folder: Path) -> Supply:
    full = _number(folder, "energy_full", "charge_full")
    design = _number(folder, "energy_full_design", "charge_full_design")
    now = _number(folder, "energy_now", "charge_now")
    percent = _number(folder, "capacity")
    charge = percent / 100 if percent is not None else _share(now, full)
    voltage, current = _number(folder, "voltage_now"), _number(folder, "current_now")
    return Supply(
        folder.name,
        _text(folder, "status") or "Unknown",
        charge,
        _share(full, design),
        voltage * MICRO if voltage is not None else None,
        current * MICRO if current is not None else None,
    )


def _share(part: float | None, whole: float | None) -> float | None:
    return part / whole if part is not None and whole else None


def _number(folder: Path, *names: str) -> float | None:
    for name in names:
        text = _text(folder, name)
        if text.lstrip("-").isdecimal():
            return float(text)
    return None


def _text(folder: Path, name: str) -> str:
    try:
        with (folder / name).open(encoding="utf-8", errors="replace") as file:
            return file.read(64).strip()
    except OSError:  # Linux shows only what the battery reports, and a battery may be taken out while it is read
        return ""


class NoTimeError(Exception):
    """Raised when a server does not answer, or not as one; the text says what happened."""


def question(sent: float) -> bytes:
    """Return a question that is sent at `sent` [s, Unix]."""
    seconds, fraction = _ntp(sent)
    return _HEADER.pack(_CLIENT, 0, 0, 0, *(0,) * 9, seconds, fraction)


def offset(answer: bytes, sent: float, received: float) -> float:
    """Return by how much the server's clock is ahead of ours [s], half of what the way takes being the error.

    Raises:
        NoTimeError: if it is no answer to the question of that time, or the server does not know the time.
    """
    if len(answer) < SIZE:
        raise NoTimeError(f"an answer of {len(answer)} bytes")
    first, stratum, _, _, *words = _HEADER.unpack(answer[:SIZE])
    if first & 7 != _SERVER or tuple(words[5:7]) != _ntp(sent):
        raise NoTimeError("an answer to another question")
    if first >> 6 == _UNSYNCHRONISED or not 0 < stratum < 16:
        raise NoTimeError("the server does not know the time")
    arrived, left = (_unix(*words[at : at + 2]) for at in (7, 9))
    return ((arrived - sent) + (left - received)) / 2


def measure(server: str, timeout: float, clock: Callable[[], float], port: int = PORT) -> float:
    """Ask a server, and return by how much it is ahead of `clock` [s, Unix].

    Raises:
        NoTimeError: if it does not answer within `timeout` [s].
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(server, port, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, kind, protocol) as link:
            link.settimeout(timeout)
            link.connect(address)
            sent = clock()
            link.send(question(sent))
            answer = link.recv(1024)
            return offset(answer, sent, clock())
    except OSError as error:
        raise NoTimeError(str(error) or type(error).__name__) from error


def _ntp(unix: float) -> tuple[int, int]:
    seconds, part = divmod(unix + ERA, 1)
    return int(seconds) % _FRACTION, int(part * _FRACTION)


def _unix(seconds: int, fraction: int) -> float:
    # The first era ends in 2036; numbers of the next one are small.
    era = _FRACTION if seconds < _FRACTION // 2 else 0
    return era + seconds + fraction / _FRACTION - ERA


@dataclass(frozen=True, slots=True)
class Usage:
    """How much is in use, from 0 to 1, in words, and what people may want to know besides."""

    share: float
    message: str
    values: Mapping[str, object]


class UsageConfig(Config):
    """When it is too much."""

    warn: Annotated[Ratio, Live()] = Field(0.9, ge=0, le=1)
    """Above this share it is WARN."""
    error: Annotated[Ratio, Live()] = Field(0.97, ge=0, le=1)
    """Above this share it is ERROR."""
    patience: Annotated[Time, Live()] = Field(5.0, ge=0)
    """How long it must be too much before the level is worse."""


U = TypeVar("U", bound=UsageConfig)


class UsageMonitor(HostMonitor[U]):
    """Reports a share of something to diagnostics once a second."""

    @classmethod
    def capabilities(cls, config: U) -> tuple[Capability, ...]:
        """Declare its limits, and the package that reads them."""
        limits = Warns(Setting(config.warn, "warn"), Setting(config.error, "error"), is_above=True)
        return limits, NEEDS_PSUTIL

    def configure(self) -> None:
        """Begin without a level."""
        self.core = LimitCore(self.limits)

    @property
    def limits(self) -> Limits:
        """Return the configured limits."""
        config = self.config
        return Limits(warn_above=config.warn, error_above=config.error, hysteresis=HYSTERESIS, patience=config.patience)

    def reconfigure(self, old: U) -> None:
        """Apply new limits."""
        self.core.limits = self.limits

    def read(self) -> Usage:
        """Return how much is in use now."""
        raise NotImplementedError

    def measure(self, dt: float) -> None:
        """Look, and report."""
        usage = self.read()
        self.status(self.core.feed(self.now, usage.share), usage.message, **usage.values)
