"""Serial ports that are opened by one program alone, and read without waiting longer than one is patient."""

from __future__ import annotations

import errno
import os
import select
import termios
from typing import TYPE_CHECKING

from rbxcompose.base.findings import FindingKind
from rbxcompose.domains.devices import serial_ports

if TYPE_CHECKING:
    import serial

_CHUNK = 4096  # [B] of one read
_STUCK = 0.2  # [s] after which a port that takes no bytes is given up
_ERRORS: dict[int | None, tuple[FindingKind, str]] = {
    errno.ENOENT: (serial_ports.NO_PORT, "does not exist"),
    errno.ENXIO: (serial_ports.NO_PORT, "has no device"),
    errno.ENODEV: (serial_ports.NO_PORT, "has no device"),
    errno.EACCES: (serial_ports.FORBIDDEN, "may not be opened by this user"),
    errno.EPERM: (serial_ports.FORBIDDEN, "may not be opened by this user"),
    errno.EBUSY: (serial_ports.BUSY, "is used by another program"),
    errno.EAGAIN: (serial_ports.BUSY, "is used by another program"),
}


def opened(path: str, baud: int) -> serial.Serial:
    """Open a serial port at any rate [bit/s] that its adapter has, for this program alone.

    Raises:
        PortError: if that cannot be done, with the reason.
    """
    import serial

    try:
        return serial.Serial(path, baud, timeout=0, exclusive=True)
    except (OSError, termios.error, ValueError, OverflowError) as error:
        number = getattr(error, "errno", None)
        kind, words = _ERRORS.get(number, (serial_ports.UNFIT, f"cannot be a serial port at {baud} bit/s"))
        raise serial_ports.PortError(kind, path, words) from error


class SerialLine:
    """A serial port by its name, which may be that of a device, at `baud` [bit/s]. It begins closed."""

    def __init__(self, name: str, baud: int) -> None:
        self.name, self.baud = name, baud
        self._port: serial.Serial | None = None

    @property
    def is_open(self) -> bool:
        """Return whether it is open."""
        return self._port is not None

    def open(self) -> None:
        """Open it, and forget what came before.

        Raises:
            PortError: if that cannot be done, with the reason.
        """
        self._port = opened(serial_ports.port_path(self.name), self.baud)
        try:
            termios.tcflush(self._port.fileno(), termios.TCIFLUSH)
        except termios.error as error:
            raise self._lost() from error

    def read(self, patience: float) -> bytes:
        """Return what has come, waiting for at most `patience` [s] for the first byte.

        Raises:
            LostPortError: if the port has gone.
        """
        try:
            descriptor = self._descriptor()
            if not select.select([descriptor], [], [], patience)[0]:
                return b""
            data = os.read(descriptor, _CHUNK)
        except (OSError, ValueError) as error:
            raise self._lost() from error
        if not data:
            raise self._lost()
        return data

    def write(self, data: bytes) -> bool:
        """Send bytes; return whether all were taken.

        Raises:
            LostPortError: if the port has gone.
        """
        sent = 0
        try:
            descriptor = self._descriptor()
            while sent < len(data):
                if not select.select([], [descriptor], [], _STUCK)[1]:
                    return False
                sent += os.write(descriptor, data[sent:])
        except BlockingIOError:
            return False
        except (OSError, ValueError) as error:
            raise self._lost() from error
        return True

    def close(self) -> None:
        """Close it."""
        if self._port is not None:
            port, self._port = self._port, None
            port.close()

    def _descriptor(self) -> int:
        if self._port is None:
            raise OSError("it is closed")
        return int(self._port.fileno())

    def _lost(self) -> serial_ports.LostPortError:
        self.close()
        return serial_ports.LostPortError(self.name, "has gone")
