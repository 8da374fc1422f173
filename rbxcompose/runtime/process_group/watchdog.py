"""A watchdog within a process: it ends the process if its loop does not run, and reports where it hung.

It counts its own wake-ups, not time: a suspended process, or a machine that slept, has not hung.
"""

from __future__ import annotations

import faulthandler
import math
import os
import sys
import threading
import time

HANG = 2.0  # [s] without an iteration of the loop after which the process ends itself
PERIOD = 0.25  # [s] between two wake-ups
MARK = "the loop did not run for "
"""First line of the dump of all threads."""


class Watchdog:
    """Ends the process with exit code 1 unless it is fed in time. It cannot detect a hang that holds Python's lock."""

    def __init__(self) -> None:
        self._seconds = HANG
        self._left = 0  # wake-ups until the end
        self._thread: threading.Thread | None = None

    def feed(self, seconds: float = HANG) -> None:
        """Let the process live for another `seconds` [s], less the part of a period that has already passed."""
        self._seconds, self._left = seconds, math.ceil(seconds / PERIOD)
        if self._thread is None:
            self._thread = threading.Thread(target=self._watch, name="watchdog", daemon=True)
            self._thread.start()

    def _watch(self) -> None:
        while self._left > 0:
            time.sleep(PERIOD)
            self._left -= 1
        sys.stderr.flush()
        os.write(2, f"{MARK}{self._seconds:g} s\n".encode())
        faulthandler.dump_traceback(file=2)
        os._exit(1)
