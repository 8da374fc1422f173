"""What is written down of a machine and its states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rbxcompose.findings import Span
from rbxcompose.missions.program.statuses import FAILURE, NAMES, SUCCESS

FINISHED, FAILED = "finished", "failed"
ENDS: Mapping[str, str] = {FINISHED: NAMES[SUCCESS], FAILED: NAMES[FAILURE]}  # those that always exist
STATE = "state"
MACHINE_KEYS = ("start", "states", "ends", "history")


@dataclass(frozen=True, slots=True)
class Next:
    """Where a state leads to, by outcome; the outcome `` stands for every one that is not named."""

    to: Mapping[str, str] = field(default_factory=dict)
    spans: Mapping[str, Span] = field(default_factory=dict)  # of the states that are named, by outcome
    keys: Mapping[str, Span] = field(default_factory=dict)  # of the outcomes


@dataclass(frozen=True, slots=True)
class MachineStates:
    """The first state, the names of the states in the order of the children, the ends with what they count as."""

    start: str = ""
    names: tuple[str, ...] = ()
    ends: Mapping[str, str] = field(default_factory=dict)
    start_span: Span | None = None
