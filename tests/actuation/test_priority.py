"""A thread that must be on time gets its priority, or is told why not; others keep theirs."""

from __future__ import annotations

import gc
import os
import threading

from rbxcompose.domains.servos.components.servo_bus import be_prompt


def test_only_the_thread_that_asks_becomes_prompt() -> None:
    found: list[tuple[str, int, int]] = []

    def ask() -> None:
        reason = be_prompt()
        own = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK
        later = threading.Thread(target=lambda: found.append((reason, own, os.sched_getscheduler(0))))
        later.start()
        later.join()

    try:
        asking = threading.Thread(target=ask)
        asking.start()
        asking.join()
    finally:
        gc.unfreeze()
    [(reason, own, later)] = found
    assert (own == os.SCHED_FIFO) == (not reason)
    assert later == os.SCHED_OTHER == os.sched_getscheduler(0)
