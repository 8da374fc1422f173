"""Watches the load of this computer's processor."""

from __future__ import annotations

import os

from rbxcompose.domains.diagnostics.monitors import Usage, UsageConfig, UsageMonitor
from rbxcompose.sdk import component


class CpuMonitorConfig(UsageConfig):
    """When the load is too much."""


@component("cpu_monitor")
class CpuMonitor(UsageMonitor[CpuMonitorConfig]):
    """Reports the load of the processor, of all cores together, and names the busiest core.

    Example:
        cpu: {type: cpu_monitor, warn: 90 %, error: 98 %, patience: 10 s}
    """

    def configure(self) -> None:
        """Begin to measure: each reading is the load since the one before."""
        super().configure()
        import psutil

        self.load = psutil.cpu_percent
        self.load(percpu=True)

    def read(self) -> Usage:
        """Return the load since the last reading."""
        cores = self.load(percpu=True)
        mean = sum(cores) / len(cores)
        values = {f"core {number}": f"{core:.0f} %" for number, core in enumerate(cores)}
        waiting = ", ".join(f"{one:.2f}" for one in os.getloadavg())
        text = f"{mean:.0f} % of {len(cores)} cores, at most {max(cores):.0f} % of one"
        return Usage(mean / 100, text, {**values, "load average": waiting})
