"""Probes: what a debugger wants of single nodes. A node without one never asks."""

from rbxcompose.base.dataclass import dataclass
from rbxcompose.missions.program.outcomes import NAMES, SKIPPED, SUCCESS

NOTHING: frozenset[str] = frozenset()


@dataclass(slots=True)
class Probe:
    """Where a node stops the mission, and what has come of that.

    `ends` are the transitions of a state that stop it, by the outcomes under which they are written. A step stops at
    the start of a leaf (`steps_in`) and at any transition of a state (`steps_out`). `is_waiting` is a node that was to
    start and has not begun. `result` is the status and the outcome with which a node will end at its next tick.
    """

    starts: bool = False
    ends: frozenset[str] = NOTHING
    steps_in: bool = False
    steps_out: bool = False
    only_first: bool = False  # a condition that a reactive list evaluates again and again
    is_waiting: bool = False
    result: tuple[int, str] | None = None

    @property
    def is_pending(self) -> bool:
        """Return whether the node only seems to run: it has not begun, or has ended."""
        return self.is_waiting or self.result is not None

    @property
    def is_needed(self) -> bool:
        """Return whether the node must still be observed."""
        return self.starts or bool(self.ends) or self.steps_in or self.steps_out or self.is_pending


def result_word(status: int) -> str:
    """Return the result that a status counts as for the transitions of a state."""
    return NAMES[SUCCESS if status == SKIPPED else status]
