"""The one door through which other threads reach the thread of a process."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable

from rbxcompose.scheduler import Scheduler


class CallbackInbox:
    """Takes callbacks from any thread or signal handler and wakes the thread that waits for its descriptor."""

    def __init__(self) -> None:
        self._descriptor = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._callbacks: deque[tuple[str, Callable[[], None]]] = deque()
        self._is_signalled = False

    def fileno(self) -> int:
        """Return the descriptor that is readable when something has arrived."""
        return self._descriptor

    @property
    def has_some(self) -> bool:
        """Return whether callbacks are waiting."""
        return bool(self._callbacks)

    def put(self, owner: str, callback: Callable[[], None]) -> None:
        """Run `callback` for `owner` on the scheduler's thread. May be called from any thread."""
        self._callbacks.append((owner, callback))
        self.wake()

    def wake(self) -> None:
        """Wake the thread that waits for the descriptor. May be called from any thread."""
        if not self._is_signalled:  # one system call per wake, not per sample
            self._is_signalled = True
            os.eventfd_write(self._descriptor, 1)

    def drain(self, scheduler: Scheduler) -> None:
        """Post everything that has arrived, in the order of arrival."""
        # Read regardless of the flag: if two threads signal at the same time, one may write after the other was served.
        try:
            os.eventfd_read(self._descriptor)
        except BlockingIOError:
            return  # nothing has arrived, or its write is still pending
        self._is_signalled = False  # before reading: anything that arrives from now on signals again
        while self._callbacks:
            scheduler.post(*self._callbacks.popleft())

    def close(self) -> None:
        """Close the descriptor; nothing must be put in afterwards."""
        os.close(self._descriptor)
