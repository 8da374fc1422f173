"""The terminal in other ways than line by line; what it was before it is again at the end, whatever happens."""

from __future__ import annotations

import termios
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TextIO

_ENTER, _LEAVE = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"  # another screen without a cursor, and back
_HOME, _END_OF_LINE, _END_OF_SCREEN = "\x1b[H", "\x1b[K", "\x1b[J"


@contextmanager
def raw(terminal: int) -> Iterator[None]:
    """Have keys at once and unseen, also those that were typed before."""
    before = termios.tcgetattr(terminal)
    try:
        tty.setcbreak(terminal, termios.TCSANOW)
        now = termios.tcgetattr(terminal)
        now[6][termios.VSUSP] = b"\0"  # who suspends us would be left with this terminal
        termios.tcsetattr(terminal, termios.TCSANOW, now)
        yield
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


@contextmanager
def full_screen(stream: TextIO) -> Iterator[None]:
    """Have the whole screen; what was on it comes back at the end."""
    stream.write(_ENTER)
    try:
        yield
    finally:
        stream.write(_LEAVE)
        stream.flush()


def show(stream: TextIO, lines: Sequence[str]) -> None:
    """Write lines from the top of the screen in the place of what was there, without a flicker."""
    text = "\r\n".join(f"{line}{_END_OF_LINE}" for line in lines)
    stream.write(f"{_HOME}{text}{_END_OF_SCREEN}")
    stream.flush()
