"""The serial port under the SDK's packets: reads wait in the kernel until a deadline, where the SDK's own port spins.

The SDK's waits are 34 ms longer than the packets need, count by the wall clock, and accept few baud rates. Here a
deadline is the time on the wire plus `timeout`, by the monotonic clock, at any rate.
"""

from __future__ import annotations

import errno
import os
import select
import termios
import time
from collections.abc import Callable, Sequence

import serial
from dynamixel_sdk import PortHandler

from rbxcompose.devices.port_errors import (
    BusyPortError,
    ForbiddenPortError,
    LostPortError,
    NoPortError,
    PortError,
    UnfitPortError,
)

BITS = 10  # of a byte on the wire: start bit, eight of data, stop bit
_CHUNK = 4096  # [B] of one read
_EARLY = 0.0005  # [s] before the last byte of long replies at which it is worth looking
_STUCK = 0.5  # [s] after which a port that takes no bytes has failed to send
_ERRORS: dict[int | None, tuple[type[PortError], str]] = {
    errno.ENOENT: (NoPortError, "does not exist"),
    errno.ENXIO: (NoPortError, "has no device"),
    errno.ENODEV: (NoPortError, "has no device"),
    errno.EACCES: (ForbiddenPortError, "may not be opened by this user"),
    errno.EPERM: (ForbiddenPortError, "may not be opened by this user"),
    errno.EBUSY: (BusyPortError, "is used by another program"),
    errno.EAGAIN: (BusyPortError, "is used by another program"),
}


class BlockingPort(PortHandler):  # type: ignore[misc]  # the SDK has no types
    """A serial port at `baud` [bit/s] whose packets may be `timeout` [s] later than the wire needs.

    With `has_echo` the adapter returns what it sends, which is dropped.

    Raises:
        PortError: when made, if the port cannot be opened; at any later use, if it has gone.
    """

    def __init__(
        self, path: str, baud: int, *, timeout: float = 0.002, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(path)
        self.is_open: bool = False
        self.timeout, self.has_echo = timeout, False
        self.reply_delay = 0.0  # [s] for which servos pause before a reply
        self._clock = clock
        self._buffer, self._own = bytearray(), bytearray()  # received; sent and not echoed yet
        self._sent = 0.0  # [s], when the last packet will have left the wire
        self._deadline, self._has_looked = 0.0, True
        self._nap = 0.0  # [s] before it is worth looking
        self.setBaudRate(baud)

    def setBaudRate(self, baudrate: int) -> bool:  # noqa: N802
        """Open the port at any rate [bit/s] that the adapter has."""
        self.baudrate = baudrate
        self._open()
        return True

    def openPort(self) -> bool:  # noqa: N802
        """Open the port again."""
        return self.setBaudRate(self.baudrate)

    def _open(self) -> None:
        if self.is_open:
            self.closePort()
        try:
            self.ser = serial.Serial(self.port_name, self.baudrate, timeout=0, exclusive=True)
            self._descriptor = self.ser.fileno()
        except (OSError, termios.error, ValueError, OverflowError) as error:
            number = getattr(error, "errno", None)
            cause, words = _ERRORS.get(number, (UnfitPortError, f"cannot be a serial port at {self.baudrate} bit/s"))
            raise cause(str(self.port_name), words) from error
        self.is_open, self.is_using = True, False
        self.tx_time_per_byte = 1000.0 * BITS / self.baudrate
        try:
            self.clearPort()
        except PortError:
            self.closePort()
            raise

    def closePort(self) -> None:  # noqa: N802
        """Close it; a port that is closed stays so."""
        if self.is_open:
            self.is_open = False
            self.ser.close()

    def clearPort(self) -> None:  # noqa: N802
        """Forget what has been received."""
        self._buffer.clear()
        self._own.clear()
        try:
            termios.tcflush(self._descriptor, termios.TCIFLUSH)
        except termios.error as error:
            raise self._lost() from error

    def getBytesAvailable(self) -> int:  # noqa: N802
        """Return how much has been received and not been read yet [B]."""
        self._fill(0.0)
        return len(self._buffer)

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Return just `length` bytes, or those that have come until the deadline."""
        if self._nap > 0 and len(self._buffer) < length:
            # The wire cannot be faster: one nap costs less than waking up for each piece of the replies.
            time.sleep(self._nap)
            self._nap = 0.0
        while len(self._buffer) < length:
            left = self._deadline - self._clock()
            # Once, what has come while this process had no processor still counts; a babbling bus must not hold it.
            if left <= 0 and self._has_looked:
                break
            self._has_looked = left <= 0
            self._fill(max(left, 0.0))
        taken = bytes(self._buffer[: max(length, 0)])
        del self._buffer[: len(taken)]
        return taken

    def unread(self, data: Sequence[int]) -> None:
        """Put bytes back, so that they are read again."""
        self._buffer[:0] = bytes(data)

    def _fill(self, patience: float) -> None:
        """Wait for bytes for at most `patience` [s]."""
        try:
            if not select.select([self._descriptor], [], [], patience)[0]:
                return
            data = os.read(self._descriptor, _CHUNK)
        except (OSError, ValueError) as error:
            raise self._lost() from error
        if not data:
            raise self._lost()
        echoed = min(len(self._own), len(data))
        del self._own[:echoed]
        self._buffer += data[echoed:]

    def writePort(self, packet: Sequence[int]) -> int:  # noqa: N802
        """Send bytes and return how many were sent; fewer if the port is stuck."""
        data, sent = bytes(packet), 0
        while sent < len(data):
            try:
                sent += os.write(self._descriptor, data[sent:])
            except BlockingIOError:
                if not select.select([], [self._descriptor], [], _STUCK)[1]:
                    break
            except (OSError, ValueError) as error:
                raise self._lost() from error
        self._sent = max(self._sent, self._clock()) + BITS * sent / self.baudrate
        if self.has_echo:
            self._own += data[:sent]
        return sent

    def wait_for(self, length: int, replies: int = 1) -> None:
        """Set the deadline of `replies` with together `length` bytes, which follow what was sent last."""
        now = self._clock()
        carried = max(self._sent, now) + BITS * length / self.baudrate
        self._wait_until(carried + replies * self.reply_delay + self.timeout)
        self._nap = carried - now - _EARLY

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802
        """Set the deadline of a packet of this length [B]."""
        self.wait_for(packet_length)

    def setPacketTimeoutMillis(self, msec: float) -> None:  # noqa: N802
        """Set the deadline to this long from now [ms]."""
        self._wait_until(self._clock() + msec / 1000)

    def _wait_until(self, deadline: float) -> None:
        self._deadline, self._has_looked, self._nap = deadline, False, 0.0

    def isPacketTimeout(self) -> bool:  # noqa: N802
        """Tell whether the deadline has passed."""
        return self._clock() >= self._deadline and self._has_looked

    def getCurrentTime(self) -> float:  # noqa: N802
        """Return monotonic time [ms]."""
        return 1000 * self._clock()

    def _lost(self) -> LostPortError:
        return LostPortError(str(self.port_name), "has gone")
