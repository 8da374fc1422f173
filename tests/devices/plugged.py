"""A device at a pseudo-terminal, at a path that stays while it is unplugged and plugged in again."""

from __future__ import annotations

import os
import select
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class PluggedDevice:
    """The far end of a serial port: what is written there is read at `path`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.is_plugged = False
        self.plug()

    def plug(self) -> None:
        self._far, self._near = os.openpty()
        tty.setraw(self._near)
        os.set_blocking(self._far, False)
        self.path.symlink_to(os.ttyname(self._near))
        self.is_plugged = True

    def unplug(self) -> None:
        if self.is_plugged:
            self.path.unlink()
            os.close(self._far)
            os.close(self._near)
            self.is_plugged = False

    @property
    def far(self) -> int:
        """Return the descriptor of the far end, for a process that has it instead of this one."""
        return self._far

    def write(self, data: bytes) -> None:
        """Write bytes; the terminal has room for some thousand."""
        assert os.write(self._far, data) == len(data)

    def read(self, patience: float = 0.0) -> bytes:
        """Return what was written to the port."""
        return os.read(self._far, 4096) if select.select([self._far], [], [], patience)[0] else b""


@contextmanager
def plugged_in(path: Path) -> Iterator[PluggedDevice]:
    device = PluggedDevice(path)
    try:
        yield device
    finally:
        device.unplug()
