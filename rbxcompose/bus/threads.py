"""Keep Zenoh's threads that call into Python attached: else each call would create and destroy their state.

That takes several times as long as our callbacks, and Zenoh's receiving threads live as long as the process.
"""

from __future__ import annotations

import ctypes
import threading

_attach = ctypes.pythonapi.PyGILState_Ensure


class _Attached(threading.local):
    is_kept = False


_attached = _Attached()


def keep_attached() -> None:
    """Keep Python's state for the calling thread, which Python did not create."""
    if not _attached.is_kept:
        _attached.is_kept = True  # part of that state, and lost with it
        _attach()  # never released, so that the state's reference count does not reach zero
