"""What a window tells of something with named parts: all of them at first, then those that have changed.

An update is `{"whole": bool, "changed": {...}, "gone": [...]}`; a whole one replaces what was known. The messages
around them are those of `Window` in `bus/services.py`.
"""

from collections.abc import Mapping
from typing import Any, Protocol

KeyedParts = Mapping[str, Any]


class UpdateSink(Protocol):
    """A window for tools outside."""

    @property
    def is_watched(self) -> bool:
        """Return whether there is a subscriber."""
        ...

    def put(self, value: object, /) -> None:
        """Send an update, as data for JSON."""
        ...


class KeyFeed:
    """Tells what is new; nothing while nobody watches."""

    def __init__(self, window: UpdateSink) -> None:
        self._window = window
        self._sent: KeyedParts | None = None  # None while nobody watched

    def update(self, parts: KeyedParts) -> None:
        """Send what differs from what was told last."""
        before, self._sent = self._sent, dict(parts) if self._window.is_watched else None
        if self._sent is None or self._sent == before:
            return
        self._window.put(whole(parts) if before is None else _difference(before, parts))


def whole(parts: KeyedParts) -> dict[str, Any]:
    """Return all parts as an update."""
    return {"whole": True, "changed": dict(parts), "gone": []}


def _difference(before: KeyedParts, parts: KeyedParts) -> dict[str, Any]:
    changed = {key: part for key, part in parts.items() if key not in before or before[key] != part}
    return {"whole": False, "changed": changed, "gone": [key for key in before if key not in parts]}


def added(known: KeyedParts, update: KeyedParts) -> dict[str, Any]:
    """Return what is known after an update."""
    kept = {} if update["whole"] else {key: entry for key, entry in known.items() if key not in update["gone"]}
    return {**kept, **update["changed"]}
