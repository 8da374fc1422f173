"""What pages follow beside topics: how often messages come on each, and the log with what `check` found before."""

import json
from collections.abc import Callable, Iterable
from itertools import count
from pathlib import Path
from typing import Any

MOST = 500  # records at once
_LEVELS = {"OK": "info", "WARN": "warning"}  # others are errors
_MOST_BYTES = 256 * 1024  # that are read of a log, from its end


def tail(path: Path, after: int) -> dict[str, Any]:
    """Return the records behind `after`, a place that an earlier answer named, at most the newest; and the next place.

    A log that was begun anew is read from its beginning; lines that are not whole yet are left for the next time.
    """
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            start = after if 0 <= after <= size else 0
            first = max(start, size - _MOST_BYTES)
            file.seek(first)
            data = file.read(size - first)
    except FileNotFoundError:
        return {"records": [], "after": 0}
    if first > start:  # within a line
        data = data[data.find(b"\n") + 1 :]
    whole, _, rest = data.rpartition(b"\n")
    records = [shown for line in whole.split(b"\n") if (shown := _shown(line)) is not None]
    return {"records": records[-MOST:], "after": size - len(rest)}


def findings(path: Path) -> list[Any]:
    """Return what `check` found when the robot came up: code, severity, file, line, message and help of each."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []  # a share of a system has none
    return found if isinstance(found, list) else []


def _shown(line: bytes) -> dict[str, Any] | None:
    """Return a record, as `runtime.log` writes it; None for a line that a full disk has torn."""
    try:
        fields = json.loads(line)
        level = _LEVELS.get(fields["level"], "error")
        shown = {"time": float(fields["t"]), "level": level, "source": fields["source"], "text": fields["text"]}
    except (ValueError, KeyError, TypeError):
        return None
    return shown | ({"detail": fields["detail"]} if fields.get("detail") else {})


SHORTEST = 0.5  # [s] between two looks that count; the others see what the one before saw
KEPT = 5.0  # [s] after the last look for which messages are counted


class TopicRates:
    """Counts the messages of topics from one look to the next; they may come in any thread."""

    def __init__(self, listen: Callable[[str, Callable[[bytes], None]], Callable[[], None]]) -> None:
        """Let `listen` pass the messages of a topic on, and return what ends that."""
        self._listen = listen
        self._counted: dict[str, tuple[Callable[[], int], Callable[[], None]]] = {}
        self._rates: dict[str, float] = {}
        self._looked = 0.0

    def look(self, topics: Iterable[str], now: float) -> dict[str, float]:
        """Return the rates [Hz] from the last look until `now` [s]; topics that were not there then have none."""
        if self._counted and now - self._looked < SHORTEST:
            return self._rates
        period, self._looked, wanted = now - self._looked, now, set(topics)
        for topic in self._counted.keys() - wanted:
            self._counted.pop(topic)[1]()
        self._rates = {topic: taken() / period for topic, (taken, _) in self._counted.items()}
        for topic in wanted - self._counted.keys():
            self._counted[topic] = self._begin(topic)
        return self._rates

    def rest(self) -> None:
        """Count no more until the next look."""
        while self._counted:
            self._counted.popitem()[1][1]()
        self._rates = {}

    def _begin(self, topic: str) -> tuple[Callable[[], int], Callable[[], None]]:
        messages, before = count(), 0

        def taken() -> int:
            nonlocal before
            now = next(messages)  # counts as well
            found, before = now - before, now + 1
            return found

        def come(message: bytes) -> None:
            next(messages)

        return taken, self._listen(topic, come)
