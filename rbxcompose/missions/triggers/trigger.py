"""A trigger as the executive has it: what starts which mission, and what becomes of those that run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.missions.engine.world import Watched
from rbxcompose.missions.triggers.schedule import Schedule

SKIP, QUEUE, INTERRUPT = "skip", "queue", "interrupt"
HALTED = "halted"


@dataclass(frozen=True, slots=True)
class Trigger:
    """Starts a mission, with inputs as text. Exactly one of the fields from `schedule` to `ends` is its cause.

    `cause` is that in words. `message` is the ROS type of the messages on `topic`. Without an `outcome`, every end of
    the mission `ends` counts that it comes to by itself. `running` is what happens if a mission is in the way.
    """

    name: str
    mission: str
    cause: str
    inputs: Mapping[str, str] = field(default_factory=dict)
    priority: int = 0
    running: str = SKIP
    schedule: Schedule | None = None
    when: Watched | None = None
    topic: str = ""
    message: str = ""
    at_start: bool = False
    ends: str = ""
    outcome: str = ""

    @property
    def reads(self) -> frozenset[str]:
        """Return the `$names` that its condition reads."""
        return self.when.names if self.when else frozenset()

    def follows(self, mission: str, ends: frozenset[str]) -> bool:
        """Return whether it is caused by an end of a mission; `ends` are the words for that end."""
        return (
            bool(self.ends) and self.ends == mission and (self.outcome in ends if self.outcome else HALTED not in ends)
        )
