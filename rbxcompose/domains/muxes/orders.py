"""What people have ordered of a mux and what holds until the robot goes down: it is repeated after a restart."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from rbxcompose.base.requests import Command
from rbxcompose.domains.muxes.requests import AddMuxInput, DeleteMuxInput, LockMuxInputs, SelectMuxInput


class MuxOrders:
    """The orders that still hold, in an order in which they can be repeated."""

    def __init__(self) -> None:
        self.added: dict[str, AddMuxInput] = {}
        self._deleted: dict[str, DeleteMuxInput] = {}
        self._locked: dict[str, LockMuxInputs] = {}
        self._selected: SelectMuxInput | None = None

    def take_over(self, old: MuxOrders, inputs: Collection[str]) -> None:
        """Continue with those of another plan that still have a meaning; what it deleted is up to the new plan."""
        self._locked = {name: mux_inputs for name, mux_inputs in old._locked.items() if name in inputs}
        if old._selected is not None and old._selected.input in inputs:
            self._selected = old._selected

    def keep(self, order: Command) -> None:
        """Keep an order, instead of earlier ones about the same."""
        match order:
            case AddMuxInput():
                self.added[order.input] = order
                self._deleted.pop(order.input, None)
            case DeleteMuxInput():
                if self.added.pop(order.input, None) is None:
                    self._deleted[order.input] = order
                self._locked.pop(order.input, None)
            case LockMuxInputs():
                self._locked |= {name: LockMuxInputs(order.component, (name,), order.seconds) for name in order.inputs}
            case SelectMuxInput():
                self._selected = order

    def forget_locks(self, locked: Collection[str]) -> bool:
        """Forget the locks that have ended, of all but these inputs; return whether there were any."""
        ended = self._locked.keys() - locked
        for name in ended:
            del self._locked[name]
        return bool(ended)

    @property
    def all(self) -> tuple[Command, ...]:
        """Return all that hold."""
        selected = (self._selected,) if self._selected else ()
        return (*self.added.values(), *selected, *self._deleted.values(), *self._locked.values())


def input_at(text: str, topics: Mapping[str, str]) -> str | None:
    """Return the input that has this name or topic; a full topic may begin with the namespace of the robot."""
    bare = text.strip("/")
    for name, topic in topics.items():
        own = topic.strip("/")
        if text == name or bare == own or (text.startswith("/") and bare.endswith(f"/{own}")):
            return name
    return None


def noted(locked: Iterable[tuple[str, float]]) -> str:
    """Return what is locked by hand, and until which robot time [s]; empty if nothing is."""
    locks = [name if until == float("inf") else f"{name} until {until:.1f} s" for name, until in locked]
    return f"locked by hand: {', '.join(locks)}" if locks else ""
