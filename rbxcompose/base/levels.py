"""Diagnostic levels, and their words."""

from enum import IntEnum


class Level(IntEnum):
    """The health of something; STALE means that its state is no longer known."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


LOG_LEVELS = {"info": Level.OK, "warn": Level.WARN, "error": Level.ERROR}
"""Log levels by the words that people write."""


def log_word(level: Level) -> str:
    """Return the word for a log level."""
    return next((word for word, known in LOG_LEVELS.items() if known is level), level.name.lower())


def level_of(number: int) -> Level:
    """Return the level for a number on the wire; an unknown number is an ERROR."""
    return Level(number) if Level.OK <= number <= Level.STALE else Level.ERROR
