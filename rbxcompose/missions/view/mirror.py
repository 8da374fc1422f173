"""What a viewer sees of a running mission: first its full state, then what has changed since the last look.

Nothing is done for it between two looks, so it costs nothing while nobody looks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.snapshot import to_plain

ACTIVE = frozenset({"running", "paused", "waiting"})  # states of a mission that is not over


class Mirror:
    """The statuses and data of an engine, each with the version in which it last changed."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._version = 0
        self._statuses: list[int] = []
        self._changed: list[int] = []  # the version of each status
        self._data: dict[str, Any] = {}
        self._data_changed: dict[str, int] = {}

    def look(self, since: int = 0) -> dict[str, Any]:
        """Return what has changed since a version; 0 gives the full state.

        The result has its `version`, `statuses` by node number, and `data` by name; `whole` means that it replaces what
        the viewer knew before.
        """
        self._take()
        if not 0 < since <= self._version:
            since = 0
        statuses = {number: self._statuses[number] for number, version in enumerate(self._changed) if version > since}
        data = {name: value for name, value in self._data.items() if self._data_changed[name] > since}
        return {"version": self._version, "whole": since == 0, "statuses": statuses, "data": data}

    def _take(self) -> None:
        """Note what has changed since the last look."""
        now = self._engine.statuses
        data = {name: to_plain(value) for name, value in self._engine.data.items()}
        if now == self._statuses and data == self._data:
            return
        self._version += 1
        if not self._statuses:
            self._changed = [self._version] * len(now)
        else:
            for number, (before, after) in enumerate(zip(self._statuses, now, strict=True)):
                if before != after:
                    self._changed[number] = self._version
        for name, value in data.items():
            if name not in self._data or self._data[name] != value:
                self._data_changed[name] = self._version
        self._statuses, self._data = list(now), data


def joined(known: Mapping[str, Any], news: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a viewer knows after an update; keys of statuses may be texts, as in JSON."""
    statuses: dict[int, int] = {} if news["whole"] else dict(known["statuses"])
    statuses.update({int(number): status for number, status in news["statuses"].items()})
    data = {**({} if news["whole"] else known["data"]), **news["data"]}
    return {**known, **news, "statuses": statuses, "data": data}


def status_list(known: Mapping[str, Any], count: int) -> Sequence[int]:
    """Return the statuses of `count` nodes in order."""
    return [known["statuses"].get(number, 0) for number in range(count)]
