"""Which stretches of memory carry which items, so that few requests read or write many."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from rbxcompose.actuation.control_items import ControlItem
from rbxcompose.actuation.servo_models import ONE_ERRORS, ServoModel

_GAP = 12  # [B] of other items that cost less than another reply
HARDWARE_ERROR = "hardware_error"  # an item in protocol 2.0, told by each reply in 1.0


class Stretch(NamedTuple):
    """Adjacent memory: `length` bytes at `address`."""

    address: int
    length: int

    @property
    def end(self) -> int:
        """Return the address behind it."""
        return self.address + self.length


class ReadPlan(NamedTuple):
    """The stretches to read for some items of a model, and each item with the number of its stretch."""

    stretches: tuple[Stretch, ...]
    items: tuple[tuple[int, ControlItem], ...]
    tells_faults: bool
    """Whether `hardware_error` is asked for that the error byte tells."""

    def values(self, parts: Sequence[bytes], alert: int) -> dict[str, int]:
        """Return the raw values in what was read of each stretch."""
        found: dict[str, int] = {HARDWARE_ERROR: alert & ONE_ERRORS} if self.tells_faults else {}
        for part, item in self.items:
            start = item.address - self.stretches[part].address
            found[item.name] = item.decode(parts[part][start : start + item.size])
        return found


def read_plan(model: ServoModel, names: Iterable[str]) -> ReadPlan:
    """Return how to read items of a model.

    Raises:
        KeyError: if the model has no such item.
    """
    asked = set(names)
    tells = HARDWARE_ERROR in asked and HARDWARE_ERROR not in model.items
    wanted = [model.item(name) for name in sorted(asked) if not (tells and name == HARDWARE_ERROR)]
    stretches = _stretches(wanted or [model.item("moving")])
    placed = tuple((_part(stretches, item), item) for item in wanted)
    return ReadPlan(stretches, placed, tells)


def _stretches(items: Iterable[ControlItem]) -> tuple[Stretch, ...]:
    found: list[Stretch] = []
    for item in sorted(items, key=lambda one: one.address):
        last = found[-1] if found else None
        if last and item.address - last.end <= _GAP:
            found[-1] = Stretch(last.address, max(last.end, item.end) - last.address)
        else:
            found.append(Stretch(item.address, item.size))
    return tuple(found)


def _part(stretches: Sequence[Stretch], item: ControlItem) -> int:
    return next(part for part, one in enumerate(stretches) if one.address <= item.address and item.end <= one.end)


def written(model: ServoModel, values: Mapping[str, int]) -> Iterator[tuple[Stretch, bytes]]:
    """Yield the stretches that raw values of a model fill without a gap, each with its bytes.

    Raises:
        KeyError: if the model has no such item.
        ValueError: if a value does not fit into its item.
    """
    encoded = sorted((model.item(name).address, model.item(name).encode(raw)) for name, raw in values.items())
    address, data = -1, b""
    for start, part in encoded:
        if start != address + len(data):
            if data:
                yield Stretch(address, len(data)), data
            address, data = start, b""
        data += part
    if data:
        yield Stretch(address, len(data)), data
