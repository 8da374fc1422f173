"""What all buses of servos have in common, whatever they are made of."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Protocol

from rbxcompose.actuation.servo_models import ServoModel, model_of_number
from rbxcompose.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class ServoReading:
    """What one servo told: raw values by item, and the time [s] at which they came.

    `alert` is the error byte of its reply. In protocol 1.0 its bits name faults; in 2.0 bit 7 tells that the item
    `hardware_error` does.
    """

    values: Mapping[str, int]
    stamp: float
    alert: int


@dataclass(slots=True)
class ServoStatistics:
    """How well a servo answers: counts since the bus was opened, and the time [s] of its last reply."""

    reads: int = 0
    errors: int = 0
    """Replies that were corrupt, too short, or told of an error of the request."""
    timeouts: int = 0
    misses: int = 0
    """Reads in a row without a reply."""
    last_seen: float | None = None


@dataclass(frozen=True, slots=True)
class FoundServo:
    """A servo that answered: where it listens, and which model it says it is."""

    id: int
    protocol: int
    number: int
    baud: int

    @property
    def model(self) -> ServoModel | None:
        """Return its model, None if the number is not known."""
        return model_of_number(self.number)

    @property
    def name(self) -> str:
        """Return the name of its model, or the number of an unknown one."""
        return self.model.name if self.model else f"model {self.number}"


class ServoBus(Protocol):
    """A bus of servos, used by one thread.

    Each method raises `PortError` if the bus has gone; then only `reopen` and `close` are of use.
    """

    def ping(self, id: int) -> FoundServo | None:
        """Return the servo at an id, None if it is silent."""
        ...

    def scan(self, ids: Iterable[int]) -> Iterator[FoundServo]:
        """Yield the servos that answer, one id after the other."""
        ...

    def read(self, ids: Sequence[int], items: Sequence[str], *, budget: float | None = None) -> dict[int, ServoReading]:
        """Return the items of all servos that answered; one that is silent costs only itself.

        What failed is tried again while less than `budget` [s] has passed.
        """
        ...

    def write(self, values: Mapping[int, Mapping[str, int]], *, is_confirmed: bool = False) -> set[int]:
        """Write raw values, by id and item; return the ids that failed.

        Without a confirmation all are written at once, and only silence that is known already counts as failure.
        """
        ...

    def reboot(self, id: int) -> bool:
        """Start a servo again, torque off; return whether it can and did."""
        ...

    def reopen(self, *, is_relaxed: bool = True) -> dict[int, FoundServo | None]:
        """Connect again; return who answers at each id. With `is_relaxed`, torque is switched off first."""
        ...

    @property
    def statistics(self) -> Mapping[int, ServoStatistics]:
        """Return how well each servo answers, by id."""
        ...

    def close(self) -> None:
        """Give the port back."""
        ...
