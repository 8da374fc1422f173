"""The terminal of a verb that shows something live, or reads keys; at the end it is as before, whatever happens."""

import os
import select
import shutil
import signal
import sys
import termios
import tty
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from types import FrameType
from typing import Self, TextIO

from rbxcompose.base.findings import kind
from rbxcompose.commands.console import handling

NO_TERMINAL = kind("RBX9027")
_MOST_READ = 4096  # bytes of keys per read
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


def is_terminal() -> bool:
    """Return whether a person can type keys and see a screen."""
    return sys.stdin.isatty() and sys.stdout.isatty()


class LiveScreen:
    """Keys in, pictures out, until q, Ctrl-C or the end of the terminal.

    Keys are read as a context, without echo; the first picture takes the whole screen.
    """

    def __init__(self) -> None:
        self.keyboard = sys.stdin.fileno()
        self.is_over = False
        self._stack = ExitStack()
        self._shown: Sequence[str] | None = None

    def __enter__(self) -> Self:
        self._stack.enter_context(handling(self._interrupted, [signal.SIGINT]))
        self._stack.enter_context(raw(self.keyboard))
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def _interrupted(self, number: int, frame: FrameType | None) -> None:
        self.is_over = True

    def typed(self) -> str:
        """Return what was typed; nothing at the end of the terminal, when it is over."""
        data = os.read(self.keyboard, _MOST_READ)
        self.is_over = self.is_over or not data
        return data.decode(errors="replace")

    def typed_early(self) -> str:
        """Return what was typed before now."""
        return self.typed() if select.select([self.keyboard], [], [], 0)[0] else ""

    def read(self) -> None:
        """Take what was typed: q ends it."""
        if "q" in self.typed().lower():
            self.is_over = True

    def wait(self, seconds: float) -> None:
        """Wait for keys, at most this long [s]."""
        if select.select([self.keyboard], [], [], seconds)[0]:
            self.read()

    def draw(self, picture: Callable[[int, int], Sequence[str]]) -> None:
        """Show the lines of a picture for so many columns and lines, unless they are there already."""
        if self._shown is None:
            self._stack.enter_context(full_screen(sys.stdout))
        size = shutil.get_terminal_size()  # takes 80 x 24 for a terminal that reports 0 x 0
        lines = picture(size.columns, size.lines)[: size.lines]
        if lines != self._shown:
            self._shown = lines
            show(sys.stdout, lines)
