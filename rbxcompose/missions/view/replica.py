"""What a viewer sees of a running mission: its full state, then what has changed since."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.snapshot import to_plain

ACTIVE = frozenset({"running", "paused", "waiting"})  # states of a mission that is not over


class Mirror:
    """The statuses and data of an engine, each with the version in which it last changed."""

    def __init__(self, engine: Engine, version: int = 0) -> None:
        """Count on from the `version` of another engine that this one replaces."""
        self._engine = engine
        self._version = self._first = version
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
        if not self._first < since <= self._version:
            since = 0
        statuses = {number: self._statuses[number] for number, version in enumerate(self._changed) if version > since}
        data = {name: value for name, value in self._data.items() if self._data_changed[name] > since}
        return {"version": self._version, "whole": since == 0, "statuses": statuses, "data": data}

    @property
    def version(self) -> int:
        """Return the newest version."""
        return self._version

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


Join = Callable[[Mapping[str, Any], Mapping[str, Any]], Mapping[str, Any]]
MOST_WAITING = 100  # updates that wait for a full state; if there are more, it is queried again


class Replica:
    """A copy that is kept up to date; `seen` is empty until the first full state has arrived."""

    def __init__(self, join: Join = joined) -> None:
        """Let `join` return what is known after an update."""
        self._join = join
        self.seen: Mapping[str, Any] = {}
        self._source, self._sequence = "", 0
        self._waiting: deque[Mapping[str, Any]] = deque(maxlen=MOST_WAITING)

    def answered(self, message: Mapping[str, Any]) -> bool:
        """Apply a full state; return whether another one must be queried."""
        if message["source"] != self._source or message["sequence"] >= self._sequence:  # else more is known already
            self._source, self._sequence = message["source"], message["sequence"]
            self.seen = self._join({}, message["value"])
        waiting = [entry for entry in self._waiting if entry["source"] == self._source]
        self._waiting.clear()
        return [entry for entry in waiting if self.apply(entry)] != []

    def apply(self, message: Mapping[str, Any]) -> bool:
        """Apply an update; return whether a full state must be queried."""
        is_known = message["source"] == self._source
        if is_known and message["sequence"] <= self._sequence:
            return False
        if not is_known or message["sequence"] != self._sequence + 1:
            self._waiting.append(message)
            return True
        self._sequence += 1
        self.seen = self._join(self.seen, message["value"])
        return False
