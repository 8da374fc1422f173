"""What a person may do to a mission that runs, as data: the log keeps it, and a replay does it again."""

from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Family


class NotPossible(ValueError):  # noqa: N818 - it is the answer to whoever intervenes
    """Raised with the reason why a mission cannot do what a person wants."""


@dataclass(frozen=True, slots=True)
class SetBreakpoints:
    """Stop before these nodes start, and at these transitions: a state with an outcome; all others are cleared."""

    starts: tuple[int, ...] = ()
    ends: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True, slots=True)
class TakeStep:
    """Go on to the start of the next leaf, or to the next transition of a machine."""


@dataclass(frozen=True, slots=True)
class ForceResult:
    """Halt a node that runs, and let it end in `success` or `failure`, perhaps with an outcome of its own."""

    node: int
    succeeds: bool
    outcome: str = ""


@dataclass(frozen=True, slots=True)
class ChangeData:
    """Set a datum of the mission."""

    name: str
    value: Any


@dataclass(frozen=True, slots=True)
class JumpToState:
    """Leave the state in which a machine is, and enter another one."""

    machine: int
    state: str


Intervention = SetBreakpoints | TakeStep | ForceResult | ChangeData | JumpToState
INTERVENTIONS: Family[Intervention] = Family((SetBreakpoints, TakeStep, ForceResult, ChangeData, JumpToState))
