"""Interrupts of a command: Ctrl-C, SIGTERM, and the end of its terminal."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130  # exit code
ENDINGS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def noted_interrupts() -> Iterator[list[int]]:
    """Yield a list to which interrupts are added; they do not end the process meanwhile."""
    interrupts: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        interrupts.append(number)

    before = {number: signal.signal(number, note) for number in ENDINGS}
    try:
        yield interrupts
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
