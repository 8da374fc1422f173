"""Which stretches of memory carry which items, so that few requests read or write many."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from rbxcompose.actuation.control_items import Coding, ControlItem
from rbxcompose.actuation.servo_models import ONE_ERRORS, ServoModel

_GAP = 12  # [B] of other items that cost less than another reply
_LETTERS = {1: "B", 2: "H", 4: "I"}  # of `struct`, by size
HARDWARE_ERROR = "hardware_error"  # an item in protocol 2.0, told by each reply in 1.0


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
    tells_faults: bool
    """Whether `hardware_error` is asked for that the error byte tells."""

    def values(self, data: Sequence[bytes], alert: int) -> dict[str, int]:
        """Return the raw values in what was read of each stretch."""
        found: dict[str, int] = {HARDWARE_ERROR: alert & ONE_ERRORS} if self.tells_faults else {}
        for part in self.parts:
            found.update(zip(part.names, part.numbers.unpack(data[part.stretch]), strict=True))
            for item in part.directed:
                found[item.name] = item.decode(found[item.name].to_bytes(item.size, "little"))
        return found


def read_plan(model: ServoModel, names: Iterable[str]) -> ReadPlan:
    """Return how to read items of a model.

    Raises:
        KeyError: if the model has no such item.
    """
    asked = set(names)
    tells = HARDWARE_ERROR in asked and HARDWARE_ERROR not in model.items
    wanted = [model.item(name) for name in sorted(asked) if not (tells and name == HARDWARE_ERROR)]
    wanted.sort(key=lambda item: item.address)
    stretches = _stretches(wanted or [model.item("moving")])
    parts = (part for number, one in enumerate(stretches) for part in _parts(number, one, wanted))
    return ReadPlan(stretches, tuple(parts), tells)


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
    for item in sorted(items, key=lambda one: one.address):
        last = found[-1] if found else None
        if last and item.address - last.end <= _GAP:
            found[-1] = Stretch(last.address, max(last.end, item.end) - last.address)
        else:
            found.append(Stretch(item.address, item.size))
    return tuple(found)


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
    for item in sorted((model.item(name) for name in names), key=lambda one: one.address):
        last = groups[-1][-1] if groups else None
        if last and item.address < last.end:
            raise ValueError(f"{last.name} and {item.name} are the same memory")
        if last and item.address == last.end:
            groups[-1].append(item)
        else:
            groups.append([item])
    made = ((Stretch(one[0].address, one[-1].end - one[0].address), tuple(one)) for one in groups)
    return tuple(WritePlan(stretch, items) for stretch, items in made)
