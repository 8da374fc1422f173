"""Which stretches of memory carry which items, and how much a cycle puts on the wire."""

from __future__ import annotations

import math
import struct
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.bus import FACTORY_DELAY, FAST, REPLY, ROOM, in_chunks, request_groups, slow_items
from rbxcompose.domains.servos.models import ONE_ERRORS, Coding, ControlItem, ServoModel

_GAP = 12  # [B] of other items that cost less than another reply
_LETTERS = {1: "B", 2: "H", 4: "I"}  # of `struct`, by size
HARDWARE_ERROR = "hardware_error"  # an item in protocol 2.0, in each reply in 1.0


class Stretch(NamedTuple):
    """Adjacent memory: `length` bytes at `address`."""

    address: int
    length: int

    @property
    def end(self) -> int:
        """Return the address behind it."""
        return self.address + self.length


class _Part(NamedTuple):
    """Items of one stretch that do not overlap: how its bytes become numbers, and which of them have a direction."""

    stretch: int
    numbers: struct.Struct
    names: tuple[str, ...]
    directed: tuple[ControlItem, ...]


class ReadPlan(NamedTuple):
    """The stretches to read for some items of a model, and where in them each item is."""

    stretches: tuple[Stretch, ...]
    parts: tuple[_Part, ...]
    has_faults: bool
    """Whether `hardware_error` is asked for that the error byte has."""

    def values(self, data: Sequence[bytes], alert: int) -> dict[str, int]:
        """Return the raw values in what was read of each stretch."""
        found: dict[str, int] = {HARDWARE_ERROR: alert & ONE_ERRORS} if self.has_faults else {}
        for part in self.parts:
            found.update(zip(part.names, part.numbers.unpack(data[part.stretch]), strict=True))
            for item in part.directed:
                found[item.name] = item.decode(found[item.name].to_bytes(item.size, "little"))
        return found


def read_plan(model: ServoModel, names: Iterable[str], lengths: dict[int, int] | None = None) -> ReadPlan:
    """Return how to read items of a model.

    A reply does not say of which stretch it is. So that a late one is not taken for that of another, each stretch of a
    servo has a length of its own, for which it may begin earlier: `lengths` has those in use, each with its end.

    Raises:
        KeyError: if the model has no such item.
    """
    asked = set(names)
    has_faults = HARDWARE_ERROR in asked and HARDWARE_ERROR not in model.items
    wanted = [model.item(name) for name in sorted(asked) if not (has_faults and name == HARDWARE_ERROR)]
    wanted.sort(key=lambda item: item.address)
    stretches = _stretches(wanted or [model.item("moving")])
    if lengths is not None:
        stretches = tuple(_of_own_length(stretch, lengths) for stretch in stretches)
    parts = (part for number, stretch in enumerate(stretches) for part in _parts(number, stretch, wanted))
    return ReadPlan(stretches, tuple(parts), has_faults)


def _parts(number: int, stretch: Stretch, items: Iterable[ControlItem]) -> Iterator[_Part]:
    """Yield the items of a stretch, those that are the same bytes in different parts."""
    left = [item for item in items if stretch.address <= item.address < stretch.end]
    while left:
        taken: list[ControlItem] = []
        for item in left:
            if not taken or item.address >= taken[-1].end:
                taken.append(item)
        left = [item for item in left if item not in taken]
        directed = tuple(item for item in taken if item.coding is Coding.DIRECTION)
        yield _Part(number, _numbers(stretch, taken), tuple(item.name for item in taken), directed)


def _numbers(stretch: Stretch, items: Iterable[ControlItem]) -> struct.Struct:
    at, text = stretch.address, "<"
    for item in items:
        letter = _LETTERS[item.size]
        text += f"{item.address - at}x{letter.lower() if item.coding is Coding.SIGNED else letter}"
        at = item.end
    return struct.Struct(f"{text}{stretch.end - at}x")


def _stretches(items: Iterable[ControlItem]) -> tuple[Stretch, ...]:
    found: list[Stretch] = []
    for item in sorted(items, key=lambda control_item: control_item.address):
        last = found[-1] if found else None
        if last and item.address - last.end <= _GAP:
            found[-1] = Stretch(last.address, max(last.end, item.end) - last.address)
        else:
            found.append(Stretch(item.address, item.size))
    return tuple(found)


def _of_own_length(stretch: Stretch, lengths: dict[int, int]) -> Stretch:
    for begin in range(stretch.address, -1, -1):
        if lengths.setdefault(stretch.end - begin, stretch.end) == stretch.end:
            return Stretch(begin, stretch.end - begin)
    return stretch


class WritePlan(NamedTuple):
    """The items that fill one stretch without a gap, in their order."""

    stretch: Stretch
    items: tuple[ControlItem, ...]

    def data(self, values: Mapping[str, int]) -> bytes:
        """Return the bytes of raw values.

        Raises:
            ValueError: if a value does not fit into its item.
        """
        return b"".join([item.encode(values[item.name]) for item in self.items])


def write_plans(model: ServoModel, names: Iterable[str]) -> tuple[WritePlan, ...]:
    """Return the stretches that some items of a model fill without a gap.

    Raises:
        KeyError: if the model has no such item.
        ValueError: if two items are the same bytes.
    """
    groups: list[list[ControlItem]] = []
    for item in sorted((model.item(name) for name in names), key=lambda control_item: control_item.address):
        last = groups[-1][-1] if groups else None
        if last and item.address < last.end:
            raise ValueError(f"{last.name} and {item.name} are the same memory")
        if last and item.address == last.end:
            groups[-1].append(item)
        else:
            groups.append([item])
    made = ((Stretch(group[0].address, group[-1].end - group[0].address), tuple(group)) for group in groups)
    return tuple(WritePlan(stretch, items) for stretch, items in made)


_BITS = 10  # of a byte on the wire, with those that begin and end it
_REQUEST = {1: 6, 2: 10}  # [B] of a request without parameters, by protocol
_NUMBER = {1: 1, 2: 2}  # [B] of an address or a length


@dataclass(frozen=True, slots=True)
class BusLoad:
    """What a cycle puts on the wire: bytes in both directions, and replies."""

    length: int = 0
    replies: int = 0

    def __add__(self, other: BusLoad) -> BusLoad:
        """Return both, one after the other."""
        return BusLoad(self.length + other.length, self.replies + other.replies)

    def time(self, baud: float, delay: float = FACTORY_DELAY) -> float:
        """Return how long it takes [s] at a rate [bit/s], if servos pause before each reply [s]."""
        return _BITS * self.length / baud + self.replies * delay

    def baud_for(self, period: float, delay: float = FACTORY_DELAY) -> float:
        """Return the least rate [bit/s] at which it takes no longer than a period [s]; infinite if there is none."""
        left = period - self.replies * delay
        return _BITS * self.length / left if left > 0.0 else math.inf


def cycle_load(servos: Mapping[int, tuple[ServoModel, str]]) -> BusLoad:
    """Return the load of the longest cycle of servos, by id with their modes: all are read, and all get a new goal."""
    models = {id_: model for id_, (model, _) in servos.items()}
    slow = (_reading({id_: model}, slow_items(model)) for id_, model in models.items())
    longest = max(slow, key=lambda load: load.time(1_000_000), default=BusLoad())
    return _reading(models, FAST) + longest + _writing(servos)


def _reading(models: Mapping[int, ServoModel], items: Sequence[str]) -> BusLoad:
    plans = {id_: read_plan(model, items).stretches for id_, model in models.items()}
    load = BusLoad()
    for protocol, ids in request_groups(models):
        for turn in range(max(len(plans[id_]) for id_ in ids)):
            wanted = [plans[id_][turn] for id_ in ids if turn < len(plans[id_])]
            answers = sum(REPLY[protocol] + stretch.length for stretch in wanted)
            load += BusLoad(_request(protocol, wanted) + answers, len(wanted))
    return load


def _request(protocol: int, wanted: Sequence[Stretch]) -> int:
    """Return the length of a request for one stretch of each of several servos [B]."""
    place = 2 * _NUMBER[protocol]
    if len(wanted) == 1:
        return _REQUEST[protocol] + place
    if protocol == 1:
        return _REQUEST[1] + 1 + 3 * len(wanted)
    if len(set(wanted)) == 1:
        return _REQUEST[2] + place + len(wanted)
    return _REQUEST[2] + (1 + place) * len(wanted)


def _writing(servos: Mapping[int, tuple[ServoModel, str]]) -> BusLoad:
    groups: dict[tuple[int, Stretch], list[int]] = defaultdict(list)
    for id_, (model, mode) in servos.items():
        for plan in write_plans(model, [f"goal_{mode}"]):
            groups[model.protocol, plan.stretch].append(id_)
    return sum((_group_write(protocol, at, ids) for (protocol, at), ids in groups.items()), BusLoad())


def _group_write(protocol: int, at: Stretch, ids: Iterable[int]) -> BusLoad:
    """Return the load of writing the same stretch of several servos, which nobody answers."""
    each, head = 1 + at.length, _REQUEST[protocol] + 2 * _NUMBER[protocol]
    return BusLoad(sum(head + each * len(chunk) for chunk in in_chunks(ids, each, ROOM[protocol])))
