"""Diagnostic levels, and how several of them are combined."""

from __future__ import annotations

from collections.abc import Iterable
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


def combined(levels: Iterable[Level]) -> Level:
    """Return the level of a group: the worst one, but ERROR if only some are STALE; OK for an empty group."""
    found = set(levels)
    if Level.STALE in found and len(found) > 1:
        return Level.ERROR
    return max(found, default=Level.OK)
