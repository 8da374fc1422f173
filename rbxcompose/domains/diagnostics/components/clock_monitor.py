"""Compares the clock of this computer with a time server."""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable
from typing import Annotated

from pydantic import Field

from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.monitors import HostMonitor, LimitCore, Limits
from rbxcompose.sdk import Capability, Config, Live, Setting, Time, Warns, component

NANO = 1e-9
PORT = 123
SIZE = 48  # [bytes] of a packet
ERA = 2_208_988_800  # [s] from the beginning of NTP's time, 1900, to that of Unix
_HEADER = struct.Struct("!BBbb11I")
_CLIENT = 0x23  # version 4, mode 3
_SERVER = 4  # mode
_UNSYNCHRONISED = 3  # leap indicator
_FRACTION = 2**32


class ClockMonitorConfig(Config):
    """Which server, and how far off is too far."""

    server: str = Field(min_length=1)
    """A host that answers by NTP: another computer of the robot, or a public one."""
    port: int = Field(PORT, gt=0, lt=2**16)
    """Its UDP port."""
    every: Time = Field(60.0, ge=1)
    """Time between two questions; public servers want at least a minute."""
    warn: Annotated[Time, Live()] = Field(0.05, gt=0)
    """An offset above this is WARN."""
    error: Annotated[Time, Live()] = Field(0.5, gt=0)
    """An offset above this is ERROR."""
    timeout: Time = Field(2.0, gt=0, le=10)
    """How long to wait for an answer."""


@component("clock_monitor")
class ClockMonitor(HostMonitor[ClockMonitorConfig]):
    """Reports how far the clock of this computer is from that of a time server: stamps of several hosts must agree.

    Example:
        clock: {type: clock_monitor, server: pool.ntp.org, warn: 50 ms, error: 500 ms}
    """

    blocking = True

    @classmethod
    def capabilities(cls, config: ClockMonitorConfig) -> tuple[Capability, ...]:
        """Declare its limits."""
        return (Warns(Setting(config.warn, "warn"), Setting(config.error, "error"), is_above=True),)

    def configure(self) -> None:
        """Ask at the first step."""
        self.core = LimitCore(Limits())
        self.asks_at = 0.0

    def measure(self, dt: float) -> None:
        """Ask when it is time."""
        if self.now < self.asks_at:
            return
        config = self.config
        self.asks_at = self.now + config.every
        try:
            offset = measure(config.server, config.timeout, lambda: self.stamp * NANO, config.port)
        except NoTimeError as error:
            self.status(Level.STALE, f"{config.server}: {error}")
            return
        self.core.limits = Limits(warn_above=config.warn, error_above=config.error)
        side = "behind" if offset > 0 else "ahead of"
        level = self.core.feed(self.now, abs(offset))
        self.status(level, f"{abs(offset) * 1000:.1f} ms {side} {config.server}", offset=f"{offset:.6f} s")


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
