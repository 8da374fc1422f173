"""Monitors of the computer that they run on."""

from __future__ import annotations

from typing import ClassVar, TypeVar

from rbxcompose.levels import Level
from rbxcompose.sdk import Component, Config, NeedsExtra, Setting

C = TypeVar("C", bound=Config)
NEEDS_PSUTIL = NeedsExtra(Setting("psutil"), Setting("monitors"))


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
