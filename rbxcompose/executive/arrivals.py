"""Pure core: the newest value of each name, when it arrived, and how many have arrived."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbxcompose.expressions.values import NOT_ARRIVED, NotArrived, Value
from rbxcompose.levels import level_of
from rbxcompose.missions.program.sources import ValueSource


class Arrivals:
    """Takes messages and keeps the values in them; times are robot time [s]."""

    def __init__(self, sources: Mapping[str, ValueSource]) -> None:
        self._sources = sources
        self._values: dict[str, Value | NotArrived] = dict.fromkeys(sources, NOT_ARRIVED)
        self._times: dict[str, float] = {}
        self._counts = dict.fromkeys(sources, 0)

    def take(self, name: str, message: Any, now: float) -> str:
        """Keep the value in a message; return what is wrong with the message, or nothing."""
        source = self._sources[name]
        try:
            value = _level(message, source.group) if source.group else _field(message, source.field)
        except AttributeError:
            return f"the messages on {source.topic} have no field '{source.field}'"
        if value is None:
            return ""  # the group has not reported yet
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        self._values[name] = float(value) * source.times / source.per if is_number else value
        self._times[name] = now
        self._counts[name] += 1
        return ""

    def value(self, name: str) -> Value | NotArrived:
        """Return the newest value in SI."""
        return self._values[name]

    def age(self, name: str, now: float) -> float | NotArrived:
        """Return the time since the last message [s]."""
        return NOT_ARRIVED if self._values[name] is NOT_ARRIVED else now - self._times[name]

    def count(self, name: str) -> int:
        """Return how many messages have arrived."""
        return self._counts[name]


def _field(message: Any, path: str) -> Any:
    value = message
    for field in path.split("."):
        value = getattr(value, field)
    return value


def _level(message: Any, group: str) -> str | None:
    """Return the level of a group of the diagnostics in lower case; None if it is absent."""
    levels = (level_of(one.level) for one in message.status if one.name == f"/{group}")
    return next((level.name.lower() for level in levels), None)
