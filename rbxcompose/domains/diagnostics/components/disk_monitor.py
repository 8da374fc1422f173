"""Watches the room on a disk."""

from __future__ import annotations

from rbxcompose.domains.diagnostics.monitors import Usage, UsageConfig, UsageMonitor
from rbxcompose.sdk import component

GIB = 2**30


class DiskMonitorConfig(UsageConfig):
    """Which disk, and when it is too full."""

    path: str = "/"
    """A file or folder on the disk."""


@component("disk_monitor")
class DiskMonitor(UsageMonitor[DiskMonitorConfig]):
    """Reports how full the disk is that holds `path`; one that cannot be read is an error of the component.

    Example:
        disk: {type: disk_monitor, path: /, warn: 90 %, error: 97 %}
    """

    blocking = True  # a disk in the network may not answer

    def configure(self) -> None:
        """Find the function that reads it."""
        super().configure()
        import psutil

        self.disk = psutil.disk_usage

    def read(self) -> Usage:
        """Return how full it is now; what only the administrator may use does not count as free."""
        disk = self.disk(self.config.path)
        text = f"{disk.free / GIB:.1f} GiB free on {self.config.path}"
        return Usage(disk.percent / 100, text, {"size": f"{disk.total / GIB:.1f} GiB"})
