"""The changes of parameters while the robot runs: who changed what, when, and from which value."""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.msgs.rbxcompose_parameters import ParameterChange
from rbxcompose.msgs.rcl_interfaces import Parameter, ParameterValue
from rbxcompose.msgs.stamps import to_nanoseconds, to_time

LONGEST = 100  # changes kept of a component
MARK = ":"  # between a component and the number of its change: `battery:3`
ROS_TOOL = "a ROS 2 tool"


@dataclass(frozen=True, slots=True)
class ChangeCause:
    """Who changes parameters; what the changes of one transaction share; the change of a component that it undoes."""

    by: str = ROS_TOOL
    together: str = ""
    undoes: int = 0


BY_A_TOOL = ChangeCause()


@dataclass(slots=True)
class ParameterHistory:
    """The last changes of the parameters of one component."""

    component: str
    changes: deque[ParameterChange] = field(default_factory=lambda: deque(maxlen=LONGEST))
    _count: int = 0

    def note(self, before: Sequence[Parameter], after: Sequence[Parameter], cause: ChangeCause, stamp: int) -> None:
        """Keep changes of the time `stamp` [ns], each with the value before it."""
        old = {one.name: one.value for one in before}
        for parameter in after:
            self._count += 1
            self.changes.append(
                ParameterChange(
                    number=self._count,
                    stamp=to_time(stamp),
                    component=self.component,
                    name=parameter.name,
                    before=old.get(parameter.name, ParameterValue()),
                    after=parameter.value,
                    by=cause.by,
                    together=cause.together,
                    undoes=cause.undoes,
                )
            )


def identity(change: ParameterChange) -> str:
    """Return what a person calls a change: `battery:3`."""
    return f"{change.component}{MARK}{change.number}"


def in_order(changes: Iterable[ParameterChange]) -> list[ParameterChange]:
    """Return changes of several components, oldest first."""
    return sorted(changes, key=lambda change: (to_nanoseconds(change.stamp), change.component, change.number))


class NothingToUndoError(ValueError):
    """Raised with the reason why no change can be taken back."""


def to_undo(changes: Iterable[ParameterChange], wanted: str = "") -> list[ParameterChange]:
    """Return the changes to take back: the last one that is not taken back yet, or the `wanted` one (`battery:3`).

    The changes of one transaction are taken back together.

    Raises:
        NothingToUndoError: if there is none, or something has changed the parameter again since.
    """
    known = in_order(changes)
    undone = {(change.component, change.undoes) for change in known if change.undoes}
    taken_back = [change for change in known if (change.component, change.number) in undone]
    gone = {change.together for change in taken_back if change.together}
    open_ones = [
        change for change in known if not change.undoes and change not in taken_back and change.together not in gone
    ]
    if wanted:
        chosen = next((change for change in known if identity(change) == wanted), None)
        if chosen is None:
            raise NothingToUndoError(f"no change '{wanted}' is known")
        if chosen not in open_ones:
            raise NothingToUndoError(f"the change '{wanted}' is {'an undo' if chosen.undoes else 'taken back already'}")
    elif not open_ones:
        raise NothingToUndoError("there is no change to take back")
    else:
        chosen = open_ones[-1]
    together = chosen.together
    found = [change for change in open_ones if change is chosen or (together and change.together == together)]
    for change in found:
        if later := _changed_since(known, change):
            name = f"{change.component}.{change.name}"
            raise NothingToUndoError(f"'{name}' was changed again by {later.by}: take back '{identity(later)}' first")
    return found


def _changed_since(known: Sequence[ParameterChange], change: ParameterChange) -> ParameterChange | None:
    """Return the last change of the same parameter since then, unless what followed was taken back again."""
    same = [other for other in known if (other.component, other.name) == (change.component, change.name)]
    last = next((other for other in reversed(same) if other.number > change.number), None)
    return last if last is not None and last.after != change.after else None
