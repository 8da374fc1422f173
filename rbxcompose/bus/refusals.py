"""Counts of refused messages from outside, by reason."""

from __future__ import annotations

from enum import StrEnum
from itertools import count


class RefusalReason(StrEnum):
    """Why a message is refused; the words complete the sentence `12 messages were refused: ...`."""

    TOO_MANY = "too many at once"
    TOO_LARGE = "too large"
    ATTACHMENT = "no ROS attachment"
    LENGTH = "wrong length"
    CONTENT = "unreadable content"
    NOT_FINITE = "a number is not finite"


class Refusals:
    """Counts refusals. Any thread may call `add`; only the scheduler's may call the rest."""

    def __init__(self) -> None:
        self._numbers = {reason: count(1) for reason in RefusalReason}  # `next` is atomic
        self._counted = dict.fromkeys(RefusalReason, 0)
        self._told = dict.fromkeys(RefusalReason, 0)
        self._told_total = 0

    def add(self, reason: RefusalReason) -> None:
        """Count one more."""
        self._counted[reason] = next(self._numbers[reason])

    @property
    def total(self) -> int:
        """Return how many messages have been refused."""
        return sum(self._counted.values())

    def news(self) -> dict[RefusalReason, int]:
        """Return how many messages were refused since the last call, by reason."""
        if self.total == self._told_total:
            return {}
        counted = dict(self._counted)
        new = {reason: counted[reason] - self._told[reason] for reason in RefusalReason}
        self._told, self._told_total = counted, sum(counted.values())
        return {reason: number for reason, number in new.items() if number > 0}


def sentence(name: str, news: dict[RefusalReason, int], what: str = "message") -> str:
    """Return a sentence on what a topic or service has refused."""
    total = sum(news.values())
    messages = f"1 {what} was" if total == 1 else f"{total} {what}s were"
    reasons = [reason if len(news) == 1 else f"{number} {reason}" for reason, number in news.items()]
    return f"{messages} refused on {name}: {', '.join(reasons)}"
