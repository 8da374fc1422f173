"""Which statuses are taken: they come from anybody on the bus, and the tree must not grow without bound."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus, KeyValue

MOST_ITEMS = 10_000
LONGEST_NAME = 256  # characters
MOST_TEXT = 8_192  # characters of a status; ten thousand of these are 80 MB


class Admission:
    """Refuses what no tree can hold, and counts it; `news` says it once for each reason."""

    def __init__(self) -> None:
        self.refused = 0
        self._told: set[str] = set()
        self._news: list[str] = []

    def takes(self, status: DiagnosticStatus, known: int) -> bool:
        """Return whether a status of a new name is taken beside `known` others."""
        reason = _reason(status.name, known)
        if reason:
            self.refused += 1
            if reason not in self._told:
                self._told.add(reason)
                self._news.append(reason)
        return not reason

    def fitted(self, status: DiagnosticStatus) -> DiagnosticStatus:
        """Return a status of bounded length: one that is too long loses its values and the end of its message."""
        values = status.values
        size = len(status.message) + len(status.hardware_id)
        for pair in values:
            size += len(pair.key) + len(pair.value)
        if size <= MOST_TEXT:
            return status
        note = KeyValue("left out", f"a status may have {MOST_TEXT:,} characters; this one had {size:,}")
        return replace(status, message=status.message[:1000], hardware_id=status.hardware_id[:1000], values=(note,))

    def news(self) -> list[str]:
        """Return the reasons for which something was refused for the first time since the last call."""
        news, self._news = self._news, []
        return news


def _reason(name: str, known: int) -> str:
    if not name.strip("/ "):
        return "statuses without a name are left out"
    if len(name) > LONGEST_NAME:
        return f"statuses whose name has more than {LONGEST_NAME} characters are left out"
    return f"there are {MOST_ITEMS:,} statuses: further names are left out" if known >= MOST_ITEMS else ""
