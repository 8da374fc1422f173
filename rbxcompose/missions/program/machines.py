"""A machine and its states, as written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Span
from rbxcompose.missions.engine.resume_points import NO_HISTORY
from rbxcompose.missions.program.statuses import FAILURE, NAMES, SUCCESS

FINISHED, FAILED = "finished", "failed"
ENDS: Mapping[str, str] = {FINISHED: NAMES[SUCCESS], FAILED: NAMES[FAILURE]}  # those that always exist
STATE = "state"
MACHINE_KEYS = ("start", "states", "ends", "history")


@dataclass(frozen=True, slots=True)
class Next:
    """Where a state leads to, by outcome; the empty outcome covers all that are not named."""

    to: Mapping[str, str] = field(default_factory=dict)
    spans: Mapping[str, Span] = field(default_factory=dict)  # of the names of these states, by outcome
    keys: Mapping[str, Span] = field(default_factory=dict)  # of the outcomes


@dataclass(frozen=True, slots=True)
class MachineStates:
    """The first state, the names of the states in the order of the children, the ends with their results."""

    start: str = ""
    names: tuple[str, ...] = ()
    ends: Mapping[str, str] = field(default_factory=dict)
    start_span: Span | None = None
    history: str = NO_HISTORY
