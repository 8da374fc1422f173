"""Compares the clock of this computer with a time server."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.limits import LimitCore, Limits
from rbxcompose.domains.diagnostics.monitors import PORT, HostMonitor, NoTimeError, measure
from rbxcompose.sdk import Capability, Config, Live, Setting, Time, Warns, component

NANO = 1e-9


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
