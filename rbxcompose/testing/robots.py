"""Running a whole robot in virtual time."""

from __future__ import annotations

from rbxcompose.dataclass import dataclass
from rbxcompose.plan.model import Plan
from rbxcompose.robot_events import MissionOver
from rbxcompose.testing.bench import Bench

LONGEST = 3600.0  # [s] of robot time


@dataclass(frozen=True, slots=True)
class Ran:
    """A robot whose mission has ended, or whose time is up."""

    bench: Bench

    @property
    def outcome(self) -> str:
        """Return how the mission ended: `success`, `failure`, or `running` if it has not."""
        ends = [event.outcome for event in self.bench.events if isinstance(event, MissionOver)]
        return str(ends[0]) if ends else "running"

    @property
    def log(self) -> str:
        """Return the log, one record a line."""
        return "\n".join(record.to_json() for record in self.bench.records)


def run_robot(plan: Plan, *, most: float = LONGEST) -> Ran:
    """Run a robot until its mission has ended, at most `most` [s] of robot time."""
    bench = Bench(plan=plan)
    seen = 0

    def is_over() -> bool:
        nonlocal seen  # asked after each instant, so only new events are looked at
        if len(bench.events) == seen:
            return False
        news, seen = bench.events[seen:], len(bench.events)
        return any(isinstance(event, MissionOver) for event in news)

    bench.run_until(is_over, most)
    return Ran(bench)
