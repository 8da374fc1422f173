"""How often messages come on each topic, counted while somebody looks."""

from collections.abc import Callable, Iterable
from itertools import count

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
