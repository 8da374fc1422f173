"""The priority of a thread that must be on time."""

from __future__ import annotations

import gc
import os

_FIRST = 1  # the lowest real-time priority: above all ordinary programs, below what others have put there


def be_prompt() -> str:
    """Let this thread run before ordinary programs, and spare it searches for garbage; return why not, or nothing.

    Linux permits it to root and to users with the limit `rtprio`. Threads and processes begun later are ordinary ones.
    """
    gc.freeze()
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(_FIRST))
    except OSError as error:
        return error.strerror or str(error)
    return ""
