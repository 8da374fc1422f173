"""What a viewer in another process knows of a mission or an arm: its full state from a query, and all updates since.

Messages are those of `bus/window.py`. Updates that arrive before the full state wait for it; when some are missing, or
the mission's process was restarted, the full state must be queried again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from rbxcompose.missions.view.mirror import joined

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
        waiting = [one for one in self._waiting if one["source"] == self._source]
        self._waiting.clear()
        return [one for one in waiting if self.heard(one)] != []

    def heard(self, message: Mapping[str, Any]) -> bool:
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
