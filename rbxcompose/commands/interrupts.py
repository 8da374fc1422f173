"""Interrupts of a command: Ctrl-C, SIGTERM, and the end of its terminal."""

import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130  # exit code
ENDINGS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def handling(handle: Callable[[int, FrameType | None], None], numbers: Sequence[int] = ENDINGS) -> Iterator[None]:
    """Let signals call `handle`; at the end they do what they did before."""
    before = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def noted_interrupts() -> Iterator[list[int]]:
    """Yield a list to which interrupts are added; they do not end the process meanwhile."""
    interrupts: list[int] = []
    with handling(lambda number, frame: interrupts.append(number)):
        yield interrupts
