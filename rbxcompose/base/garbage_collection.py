"""Holding back Python's garbage collector where much is created and little dropped: it would traverse all in vain."""

import atexit
import gc
from collections.abc import Iterator
from contextlib import contextmanager

_USUAL = gc.get_threshold()
_NEW_OBJECTS = 300_000  # some 60 MB


def collect_rarely() -> None:
    """Have the collector wait for many new objects: a command imports and reads much, and soon ends.

    In the end, it takes no last look at what the system takes back at once.
    """
    gc.set_threshold(_NEW_OBJECTS, *_USUAL[1:])
    atexit.register(gc.freeze)


def collect_as_usual() -> None:
    """Have the collector work as it does in any program: often, but shortly, in what must not be held up."""
    gc.set_threshold(*_USUAL)


@contextmanager
def paused_collection() -> Iterator[None]:
    """Pause the collector while data without cycles is built, in about half the time; restore it at the end."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
