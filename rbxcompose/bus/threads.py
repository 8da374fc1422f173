"""Threads of Zenoh that call into Python stay known to it: else each call would create and destroy their state.

That takes several times as long as the callbacks here do, and Zenoh's receiving threads live as long as the process.
"""

from __future__ import annotations

import ctypes
import threading

_attach = ctypes.pythonapi.PyGILState_Ensure


class _Attached(threading.local):
    is_kept = False


_attached = _Attached()


def keep_attached() -> None:
    """Keep the state that Python has for the calling thread, which is not one of Python's own."""
    if not _attached.is_kept:
        _attached.is_kept = True  # is part of that state: with it, it would be gone
        _attach()  # never released, so that the count of who needs the state does not reach zero
