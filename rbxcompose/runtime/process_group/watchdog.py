"""A watchdog within a process: it ends the process if its loop does not run, and reports where it hung.

It counts its own wake-ups, not time: a suspended process, or a machine that slept, has not hung. Nor has a process that
waits for a processor, so that time does not count either.
"""

from __future__ import annotations

import faulthandler
import os
import sys
import threading
import time

from rbxcompose.runtime.processes import longest_wait, waits_of

HANG = 2.0  # [s] without an iteration of the loop after which the process ends itself
PERIOD = 0.25  # [s] between two wake-ups
MARK = "the loop did not run for "
"""First line of the dump of all threads."""


class Watchdog:
    """Ends the process with exit code 1 unless it is fed in time. It cannot detect a hang that holds Python's lock."""

    def __init__(self) -> None:
        self._seconds = self._left = HANG  # [s] that it was given, and of them until the end
        self._is_fed = True
        self._thread: threading.Thread | None = None

    def feed(self, seconds: float = HANG) -> None:
        """Let the process live for another `seconds` [s], less the part of a period that has already passed."""
        self._seconds = self._left = seconds
        self._is_fed = True
        if self._thread is None:
            self._thread = threading.Thread(target=self._watch, name="watchdog", daemon=True)
            self._thread.start()

    def _watch(self) -> None:
        waits: dict[str, float] = {}
        while self._left >= PERIOD / 2:
            self._is_fed = False
            time.sleep(PERIOD)
            if self._is_fed:
                self._left -= PERIOD
                waits = {}
                continue
            before, waits = waits, waits_of(os.getpid())
            self._left -= PERIOD - min(PERIOD, longest_wait(before, waits) if before else 0.0)
        sys.stderr.flush()
        os.write(2, f"{MARK}{self._seconds:g} s\n".encode())
        faulthandler.dump_traceback(file=2)
        os._exit(1)
