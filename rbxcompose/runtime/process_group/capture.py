"""Turns what code prints, or sends to Python's `logging`, into lines of the robot's log."""

from __future__ import annotations

import io
import logging
import os
import stat
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TextIO

from rbxcompose.base.levels import Level

OnLine = Callable[[Level, str, str], None]  # level, text, detail; called in the thread that printed

_OUTPUT = Path("/proc/self/fd/1")


class Capture:
    """Takes standard output, standard error and all loggers of this process while it is entered."""

    def __init__(self, on_line: OnLine) -> None:
        self._on_line = on_line
        self._is_passing = threading.local()

    def __enter__(self) -> Capture:
        self._before = sys.stdout, sys.stderr
        sys.stdout = _Lines(sys.__stdout__, lambda line: self._pass_on(Level.OK, line))
        sys.stderr = _Lines(sys.__stderr__, lambda line: self._pass_on(Level.WARN, line))
        self._handler = _Handler(self._pass_on)
        root = logging.getLogger()
        root.addHandler(self._handler)
        self._level = root.level
        root.setLevel(logging.INFO)
        logging.captureWarnings(True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, _Lines):
                stream.end()
        sys.stdout, sys.stderr = self._before
        logging.captureWarnings(False)
        logging.getLogger().removeHandler(self._handler)
        logging.getLogger().setLevel(self._level)

    def _pass_on(self, level: Level, text: str, detail: str = "") -> None:
        if getattr(self._is_passing, "now", False):
            os.write(2, f"{text}\n{detail}".encode(errors="backslashreplace"))  # the log itself reports something
            return
        self._is_passing.now = True
        try:
            self._on_line(level, text, detail)
        finally:
            self._is_passing.now = False


class _Lines(io.TextIOBase):
    """A stream of whole lines; the unfinished line of a thread waits for its rest."""

    def __init__(self, raw: TextIO | None, on_line: Callable[[str], None]) -> None:
        self._raw, self._on_line = raw, on_line
        self._begun: dict[int, str] = {}  # by thread

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        if self._raw is None:
            raise io.UnsupportedOperation("there is no file below")
        return self._raw.fileno()

    def write(self, text: str) -> int:
        thread = threading.get_ident()
        *lines, rest = (self._begun.pop(thread, "") + text).split("\n")
        if rest:
            self._begun[thread] = rest
        for line in lines:
            self._say(line)
        return len(text)

    def end(self) -> None:
        """Log lines that were begun and will not be finished."""
        while self._begun:
            self._say(self._begun.popitem()[1])

    def _say(self, line: str) -> None:
        if line.strip():
            self._on_line(line.rstrip("\r"))


class _Handler(logging.Handler):
    def __init__(self, on_line: OnLine) -> None:
        super().__init__()
        self._on_line = on_line

    def emit(self, record: logging.LogRecord) -> None:
        try:
            text, detail = f"{record.name}: {record.getMessage()}", ""
            if record.exc_info:
                detail = logging.Formatter().formatException(record.exc_info)
        except Exception:  # arguments that do not fit their text: logging itself reports it like this
            self.handleError(record)
            return
        self._on_line(_level_of(record.levelno), text, detail)


def _level_of(number: int) -> Level:
    if number >= logging.ERROR:
        return Level.ERROR
    return Level.WARN if number >= logging.WARNING else Level.OK


def take_printed() -> list[str]:
    """Return the lines written past Python to the file of standard output, such as from C, and empty it."""
    about = os.fstat(1)
    if not stat.S_ISREG(about.st_mode) or not about.st_size:
        return []
    text = _OUTPUT.read_text(encoding="utf-8", errors="replace")
    os.ftruncate(1, 0)
    return [line for line in text.splitlines() if line.strip()]
