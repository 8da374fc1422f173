"""Single items of servos beside those of joints: lights and ports of servos, written and read between the cycles."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field

from rbxcompose.actuation.bus import ServoBus
from rbxcompose.actuation.servo_models import ServoModel
from rbxcompose.dataclass import dataclass

PERIOD = 0.1  # [s] between two uses of one item


@dataclass(slots=True)
class ServoItem:
    """One item of a servo, which a controller reads or writes; `setup` is written before, without torque."""

    id: int
    model: ServoModel
    name: str
    is_read: bool = False
    setup: Mapping[str, int] = field(default_factory=dict)
    value: float = math.nan
    """The last reading, in the unit of the item."""
    problem: str = ""
    """Why it was not read or written; empty if it was."""
    wanted: int | None = None
    """Raw value that is not written yet."""
    written: int | None = None
    """Raw value that was written last."""
    due: float = -math.inf
    """When it may be used again [s]."""

    def write(self, raw: int) -> None:
        """Write a raw value in one of the next cycles; a newer one replaces it."""
        self.wanted = raw

    def use(self, bus: ServoBus, now: float) -> None:
        """Write what is wanted, or read it.

        Raises:
            PortError: if the bus has gone.
        """
        self.due = now + PERIOD
        if self.wanted is not None:
            failed = bus.write({self.id: {self.name: self.wanted}}, is_confirmed=True)
            self.problem = f"servo {self.id} did not take '{self.name}'" if failed else ""
            if not failed:
                self.written, self.wanted = self.wanted, None
        elif self.is_read:
            reading = bus.read([self.id], [self.name]).get(self.id)
            self.problem = "" if reading else f"servo {self.id} does not answer"
            self.value = self.model.to_si(self.name, reading.values[self.name]) if reading else math.nan


def use_next(items: Sequence[ServoItem], bus: ServoBus, now: float) -> None:
    """Use the item that has waited longest, if one is due.

    Raises:
        PortError: if the bus has gone.
    """
    due = [one for one in items if one.due <= now + 1e-9 and (one.is_read or one.wanted is not None)]
    if due:
        min(due, key=lambda one: one.due).use(bus, now)


def set_up(items: Sequence[ServoItem], bus: ServoBus) -> Iterator[str]:
    """Write what items need before they are used, and again what they had; yield sentences on lasting changes.

    Raises:
        PortError: if the bus has gone.
    """
    for item in items:
        if item.wanted is None:
            item.wanted = item.written  # a servo that had no supply has forgotten it
        reading = bus.read([item.id], list(item.setup)).get(item.id) if item.setup else None
        changed = {name: raw for name, raw in item.setup.items() if reading and reading.values[name] != raw}
        if changed:
            bus.write({item.id: {"torque_enable": 0}}, is_confirmed=True)
            failed = bus.write({item.id: changed}, is_confirmed=True)
            told = ", ".join(f"{name} {raw}" for name, raw in changed.items())
            yield f"servo {item.id} {'did not take' if failed else 'now has'} {told}"
