"""What all buses of servos have in common: their types, what is read in each cycle, what can be wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Protocol

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Severity, kind
from rbxcompose.base.plugins import Plugins
from rbxcompose.domains.servos.models import ServoModel, find_model, model_of_number

NOT_INSTALLED = kind("RBX2207")
SILENT = kind("RBX2208")
ID_TAKEN = kind("RBX2209")
NO_ITEM = kind("RBX2210")
REFUSED = kind("RBX2211")
UNKNOWN_MODEL = kind("RBX2212")
OTHER_RATE = kind("RBX2250", Severity.WARNING)


FAST = ("present_position", "present_speed", "present_load")
"""Of all servos."""
_SLOW = ("present_temperature", "present_voltage")
_RARE = ("hardware_error", "bus_watchdog")  # of models that have them


SELDOM = 10
"""In one of so many cycles, whether a servo has torque is read instead, or its torque limit."""


def slow_items(model: ServoModel) -> list[str]:
    """Return what is read of one servo, another one in each cycle."""
    return [*_SLOW, *(name for name in _RARE if name in model.items)]


REPLY: Mapping[int, int] = {1: 6, 2: 11}
"""Length of a reply without data, by protocol [B]."""
ROOM: Mapping[int, int] = {1: 230, 2: 900}
"""What of several servos fits into one request, by protocol [B]."""
FACTORY_DELAY = 0.0005
"""Pause of servos before a reply, as they are sold [s]."""
_BULK, _REQUEST = 200, 5  # [B] of a bulk read in 1.0; of one servo in a group request, at most


def in_chunks(ids: Iterable[int], each: int, most: int) -> Iterator[list[int]]:
    """Yield ids in groups of which each fits into one request of `most` bytes, at `each` [B] per id."""
    whole, size = list(ids), max(1, most // each)
    for start in range(0, len(whole), size):
        yield whole[start : start + size]


def request_groups(models: Mapping[int, ServoModel]) -> Iterator[tuple[int, list[int]]]:
    """Yield a protocol and the ids that one request can ask."""
    two = [servo for servo, model in models.items() if model.protocol == 2]
    for chunk in in_chunks(two, _REQUEST, ROOM[2]):
        yield 2, chunk
    numbers = [servo for servo, model in models.items() if model.protocol == 1]
    bulk = [servo for servo in numbers if models[servo].family.has_bulk_read]
    for chunk in in_chunks(bulk, _REQUEST, _BULK):
        yield 1, chunk
    yield from ((1, [servo]) for servo in numbers if servo not in bulk)


@dataclass(frozen=True, slots=True)
class ServoReading:
    """What one servo reported: raw values by item, and the time [s] at which they came.

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
    """Replies that were corrupt, too short, or had an error of the request."""
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

    def scan(self, ids: Iterable[int]) -> Iterator[FoundServo]:
        """Yield the servos that answer, one id after the other."""

    def read(self, ids: Sequence[int], items: Sequence[str], *, budget: float | None = None) -> dict[int, ServoReading]:
        """Return the items of all servos that answered; one that is silent costs only itself.

        What failed is tried again while less than `budget` [s] has passed.
        """

    def write(self, values: Mapping[int, Mapping[str, int]], *, is_confirmed: bool = False) -> set[int]:
        """Write raw values, by id and item; return the ids that failed.

        Without a confirmation all are written at once, and only silence that is known already counts as failure.
        """

    def reboot(self, id: int) -> bool:
        """Start a servo again, torque off; return whether it can and did."""

    def reopen(self, *, is_relaxed: bool = True) -> dict[int, FoundServo | None]:
        """Connect again; return who answers at each id. With `is_relaxed`, torque is switched off first."""

    @property
    def statistics(self) -> Mapping[int, ServoStatistics]:
        """Return how well each servo answers, by id."""

    def close(self) -> None:
        """Give the port back."""


PLUGINS = Plugins("bus_type", "bus_types")
DYNAMIXEL = "dynamixel"


class OpensBus(Protocol):
    """Opens a bus at the path of a port, for servos by id."""

    def __call__(
        self, path: str, servos: Mapping[int, ServoModel], *, baud: int, clock: Callable[[], float], is_fast: bool
    ) -> ServoBus:
        """Return the bus; `is_fast` if it may use what old firmware lacks. PortError if there is no such port."""


@dataclass(frozen=True, slots=True)
class BusType:
    """A type of bus: `package` is what it needs beside rbxcompose, which the extra `extra` installs."""

    name: str
    open: OpensBus
    models: Callable[[], Mapping[str, ServoModel]]
    package: str = ""
    extra: str = ""

    def model(self, name: str) -> ServoModel | None:
        """Return a model by its name; capitals, signs and revisions do not matter."""
        return find_model(name, self.models())


_TYPES: dict[str, BusType] = {}


def bus_type_declared(
    name: str, models: Callable[[], Mapping[str, ServoModel]], *, package: str = "", extra: str = ""
) -> Callable[[OpensBus], OpensBus]:
    """Declare a type of bus by the function that opens one."""

    def register(opens: OpensBus) -> OpensBus:
        _TYPES[name] = BusType(name, opens, models, package, extra)
        return opens

    return register


def bus_type_names() -> list[str]:
    """Return the names of all types, sorted, without importing any."""
    return sorted({*PLUGINS.names(), *_TYPES})


def bus_type(name: str) -> BusType:
    """Return a type, importing its file if necessary.

    Raises:
        KeyError: if no type has this name.
        BrokenPluginError: if it belongs to another package and cannot be used.
    """
    return PLUGINS.find(name, _TYPES, f"type by @bus_type_declared({name!r}, ...)")
