"""What all sensors at serial ports have in common: the port, which may go and come back, and what cannot be read."""

from __future__ import annotations

import math
from collections import Counter
from typing import Annotated, ClassVar, TypeVar

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.config import BitRate
from rbxcompose.base.levels import Level
from rbxcompose.domains.devices.sections.devices import SerialPortName
from rbxcompose.domains.devices.serial_ports import PortError, SerialLine

AGAIN = 1.0  # [s] between two tries to open a port
WAIT = 0.015  # [s] of a step in which it waits for bytes, in real time
REPORTED = 1.0  # [s] between two reports
SILENT = 3.0  # [s] without anything that can be read, after which that is an error
_FAULTY = 5.0  # [s] for which a fault is shown


class SerialConfig(sdk.Config):
    """Where a device is."""

    port: SerialPortName
    """Its serial port, such as `/dev/ttyUSB0`, or `dev:NAME` of one of `devices`."""
    baud: Annotated[BitRate, Field(gt=0)] = 9600
    """Bits per second."""


C = TypeVar("C", bound=SerialConfig)
NEEDS_SERIAL = sdk.NeedsExtra(sdk.Setting("serial"), sdk.Setting("serial"))


class SerialSensor(sdk.Component[C]):
    """A device at a serial port: what it sends goes to `take`; what its decoder cannot read is counted in `faults`."""

    blocking = True  # an adapter may hang
    rate = 50.0
    what: ClassVar[str] = "the device"

    @classmethod
    def capabilities(cls, config: C) -> tuple[sdk.Capability, ...]:
        """Declare its port, and what it needs."""
        return NEEDS_SERIAL, sdk.OpensPort(sdk.Setting(config.port, "port"))

    def configure(self) -> None:
        """Begin with a closed port."""
        self.line = SerialLine(self.config.port, int(self.config.baud))
        self.at_end.callback(self.line.close)
        self.patience = WAIT if self.context.clock.is_real else 0.0
        self.faults: Counter[str] = Counter()  # by what is wrong
        self.bytes_since = 0  # since something could be read
        self.tried_at = self.reported_at = -math.inf
        self.since = self.read_at = self.faulty_at = -math.inf  # opened, read something, found a fault: the last times
        self.counted = 0
        self.trouble = ""

    def step(self, dt: float) -> None:
        """Read what has come."""
        try:
            if not self.line.is_open and not self.open():
                return
            data = self.line.read(self.patience)
        except PortError as error:
            self.lose(error)
            return
        if data:
            self.bytes_since += len(data)
            self.take(data)
        if self.now - self.reported_at >= REPORTED - 1e-6:
            self.reported_at = self.now
            self.report()

    def open(self) -> bool:
        """Open the port, at most once a second; return whether it is open."""
        if self.now - self.tried_at < AGAIN:
            return False
        self.tried_at = self.now
        self.line.open()
        self.since, self.bytes_since = self.now, 0
        self.begin()
        return True

    def lose(self, error: PortError) -> None:
        """Report a port that cannot be opened or has gone; it is tried again."""
        self.line.close()
        self.tried_at = self.now
        self.complain(f"{error}; it is tried again")

    def complain(self, text: str, **values: object) -> None:
        """Report an error, and log it when it begins."""
        if text != self.trouble:
            self.warn(text)
        self.trouble = text
        self.status(Level.ERROR, text, **values)

    def understood(self) -> None:
        """Note that something could be read."""
        self.read_at, self.bytes_since = self.now, 0

    def report(self) -> None:
        """Report how the device is."""
        total = self.faults.total()
        if total != self.counted:
            self.counted, self.faulty_at = total, self.now
        values = {what: str(count) for what, count in sorted(self.faults.items())}
        if self.now - max(self.since, self.read_at) > SILENT:
            words = f"{self.what} is silent"
            if self.bytes_since:
                words = f"nothing that {self.what} sends can be read: does it really send at {self.line.baud} bit/s?"
            self.complain(words, **values)
            return
        if self.trouble and self.read_at < self.since:
            self.status(Level.WARN, "its port is open again, and nothing came yet")
            return
        if self.trouble:
            self.trouble = ""
            self.info(f"{self.what} is back")
        level, words = self.state()
        if level is Level.OK and self.now - self.faulty_at < _FAULTY:
            level, words = Level.WARN, f"{words}; some of what comes cannot be read"
        self.status(level, words, **self.values(), **values)

    def begin(self) -> None:
        """Forget half of what came before: the port was opened."""

    def take(self, data: bytes) -> None:
        """Take bytes in any pieces."""
        raise NotImplementedError

    def state(self) -> tuple[Level, str]:
        """Return how the device is, as far as it can be read."""
        return (Level.OK, f"{self.what} sends") if self.read_at > -math.inf else (Level.STALE, "nothing came yet")

    def values(self) -> dict[str, str]:
        """Return what people may want to know besides."""
        return {}
