"""Watches the memory of this computer."""

from __future__ import annotations

from rbxcompose.domains.diagnostics.monitors import Usage, UsageConfig, UsageMonitor
from rbxcompose.sdk import component

GIB = 2**30


class MemoryMonitorConfig(UsageConfig):
    """When too much memory is in use."""


@component("memory_monitor")
class MemoryMonitor(UsageMonitor[MemoryMonitorConfig]):
    """Reports how much of the memory is in use: all that a program could not have without swapping.

    Example:
        memory: {type: memory_monitor, warn: 85 %, error: 95 %}
    """

    def configure(self) -> None:
        """Find the functions that read it."""
        super().configure()
        import psutil

        self.memory, self.swap = psutil.virtual_memory, psutil.swap_memory

    def read(self) -> Usage:
        """Return how much is in use now."""
        memory, swap = self.memory(), self.swap()
        text = f"{memory.available / GIB:.1f} of {memory.total / GIB:.1f} GiB available"
        return Usage(1 - memory.available / memory.total, text, {"swap in use": f"{swap.used / GIB:.1f} GiB"})
