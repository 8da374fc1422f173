"""Watches a network interface of this computer."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.monitors import NEEDS_PSUTIL, HostMonitor
from rbxcompose.sdk import Capability, Config, Live, component

MEBI = 2**20


class NetworkMonitorConfig(Config):
    """Which interface."""

    interface: str = Field(min_length=1)
    """Its name: `wlan0`."""
    most_faults: Annotated[float, Live()] = Field(10.0, ge=0)
    """More packets per second than this that are lost or broken are a warning."""


@dataclass(frozen=True, slots=True)
class Traffic:
    """Bytes and packets of an interface since the computer started; `faults` were lost or broken."""

    received: int
    sent: int
    faults: int


@component("network_monitor")
class NetworkMonitor(HostMonitor[NetworkMonitorConfig]):
    """Reports an interface: ERROR when it is absent or down, WARN when packets are lost, and how much passes.

    Example:
        wifi: {type: network_monitor, interface: wlan0}
    """

    @classmethod
    def capabilities(cls, config: NetworkMonitorConfig) -> tuple[Capability, ...]:
        """Declare the package that reads it."""
        return (NEEDS_PSUTIL,)

    def configure(self) -> None:
        """Find the functions that read it."""
        import psutil

        self.interfaces, self.counters = psutil.net_if_stats, psutil.net_io_counters
        self.before: Traffic | None = None

    def measure(self, dt: float) -> None:
        """Look, and report."""
        state = self.interfaces().get(self.config.interface)
        if state is None or not state.isup:
            self.before = None
            what = "does not exist" if state is None else "is down"
            self.status(Level.ERROR, f"'{self.config.interface}' {what}")
            return
        counted = self.counters(pernic=True, nowrap=True)[self.config.interface]
        faults = counted.errin + counted.errout + counted.dropin + counted.dropout
        self.judge(Traffic(counted.bytes_recv, counted.bytes_sent, faults), dt, state.speed)

    def judge(self, now: Traffic, dt: float, speed: int) -> None:
        """Report what passed in `dt` [s]; `speed` is what the link can carry [Mbit/s], 0 if it is unknown."""
        before, self.before = self.before or now, now
        received, sent = (now.received - before.received) / dt / MEBI, (now.sent - before.sent) / dt / MEBI
        faults = (now.faults - before.faults) / dt
        text = f"{received:.2f} MiB/s in, {sent:.2f} MiB/s out"
        is_bad = faults > self.config.most_faults
        values = {"faults": now.faults, "link": f"{speed} Mbit/s" if speed else "unknown"}
        text = f"{faults:.0f} faulty packets a second" if is_bad else text
        self.status(Level.WARN if is_bad else Level.OK, text, **values)
