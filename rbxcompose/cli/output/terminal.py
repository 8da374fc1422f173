"""Raw and full-screen modes of the terminal; its previous state is restored at the end, whatever happens."""

from __future__ import annotations

import termios
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TextIO

from rbxcompose.findings import kind

NO_TERMINAL = kind("RBX9027")
_ENTER, _LEAVE = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"  # alternate screen without a cursor, and back
_HOME, _END_OF_LINE, _END_OF_SCREEN = "\x1b[H", "\x1b[K", "\x1b[J"


@contextmanager
def raw(terminal: int) -> Iterator[None]:
    """Read keys immediately and without echo, including those typed before."""
    before = termios.tcgetattr(terminal)
    try:
        tty.setcbreak(terminal, termios.TCSANOW)
        now = termios.tcgetattr(terminal)
        now[6][termios.VSUSP] = b"\0"  # suspending us would leave the user with this terminal
        termios.tcsetattr(terminal, termios.TCSANOW, now)
        yield
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


@contextmanager
def full_screen(stream: TextIO) -> Iterator[None]:
    """Use the whole screen; restore its contents at the end."""
    stream.write(_ENTER)
    try:
        yield
    finally:
        stream.write(_LEAVE)
        stream.flush()


def show(stream: TextIO, lines: Sequence[str]) -> None:
    """Write lines from the top of the screen over the old contents, without flicker."""
    text = "\r\n".join(f"{line}{_END_OF_LINE}" for line in lines)
    stream.write(f"{_HOME}{text}{_END_OF_SCREEN}")
    stream.flush()
