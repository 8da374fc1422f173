"""Fake servos as a bus without bytes: the twin of a bus, which moves with the clock that it is given."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from rbxcompose.actuation.bus import FoundServo, ServoReading, ServoStatistics
from rbxcompose.twins.servo_fake import FakeServo
from rbxcompose.twins.servo_line import FakeLine


class TwinBus:
    """A bus whose servos answer at once; those that are mute do not."""

    def __init__(self, servos: Iterable[FakeServo], clock: Callable[[], float]) -> None:
        self.line = FakeLine(servos, clock)
        self._clock = clock
        self._statistics = {servo.id: ServoStatistics() for servo in self.line.servos}

    @property
    def statistics(self) -> Mapping[int, ServoStatistics]:
        """Return how well each servo answers, by id."""
        return self._statistics

    def _answering(self, ids: Iterable[int]) -> Iterator[FakeServo]:
        self.line.advance()
        wanted = set(ids)
        for servo in self.line.servos:
            if servo.id in wanted:
                servo.heard = self._clock()
                statistics = self._statistics[servo.id]
                if servo.faults.is_mute:
                    statistics.timeouts, statistics.misses = statistics.timeouts + 1, statistics.misses + 1
                    continue
                statistics.misses, statistics.last_seen = 0, self._clock()
                yield servo

    def ping(self, id: int) -> FoundServo | None:
        """Return the servo at an id, None if it is silent."""
        return next(self.scan([id]), None)

    def scan(self, ids: Iterable[int]) -> Iterator[FoundServo]:
        """Yield the servos that answer."""
        for servo in self._answering(ids):
            yield FoundServo(servo.id, servo.model.protocol, servo.model.number, servo.baud)

    def read(self, ids: Sequence[int], items: Sequence[str], *, budget: float | None = None) -> dict[int, ServoReading]:
        """Return the items of all servos that answered."""
        found = {}
        for servo in self._answering(ids):
            self._statistics[servo.id].reads += 1
            found[servo.id] = ServoReading({item: servo.get(item) for item in items}, self._clock(), servo.alert)
        return found

    def write(self, values: Mapping[int, Mapping[str, int]], *, is_confirmed: bool = False) -> set[int]:
        """Write raw values, by id and item; return the ids that failed."""
        failed = set(values)
        for servo in self._answering(values):
            items = ((servo.model.item(name), raw) for name, raw in values[servo.id].items())
            results = [servo.write(item.address, item.encode(raw)) for item, raw in items]
            if not any(results):
                failed.discard(servo.id)
        return failed if is_confirmed else set()

    def reboot(self, id: int) -> bool:
        """Start a servo again, torque off."""
        servos = list(self._answering([id]))
        for servo in servos:
            servo.reboot()
        return bool(servos)

    def reopen(self, *, is_relaxed: bool = True) -> dict[int, FoundServo | None]:
        """Return who answers at each id, relaxed."""
        if is_relaxed:
            self.write({servo.id: {"torque_enable": 0} for servo in self.line.servos})
        return {servo.id: self.ping(servo.id) for servo in self.line.servos}

    def close(self) -> None:
        """Do nothing: there is no port."""
