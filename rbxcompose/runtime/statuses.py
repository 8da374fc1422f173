"""The diagnostic statuses of a process: kept here, sent once a second and at once when a level changes."""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.bus.bus import Bus
from rbxcompose.clock import Clock
from rbxcompose.diagnostics.levels import Level
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.qos import Qos
from rbxcompose.scheduler import Scheduler

PERIOD = 1.0  # [s] between two reports
TOPIC = "/diagnostics"


class Statuses:
    """What each component of a process said last about itself."""

    def __init__(self, owner: str, bus: Bus, scheduler: Scheduler, clock: Clock) -> None:
        self._owner, self._scheduler, self._clock = owner, scheduler, clock
        self._publisher = bus.publisher(owner, TOPIC, DiagnosticArray, Qos.STATE)
        self._statuses: dict[str, DiagnosticStatus] = {}
        self._is_due = False
        scheduler.every(PERIOD, owner, lambda dt: self.publish())

    def set(self, name: str, level: Level, message: str, values: Mapping[str, object]) -> None:
        """Keep a status; one with a new level goes out at this instant."""
        before = self._statuses.get(name)
        pairs = tuple(KeyValue(key=key, value=str(value)) for key, value in values.items())
        self._statuses[name] = DiagnosticStatus(level=int(level), name=name, message=message, values=pairs)
        if (before is not None and before.level == level) or self._is_due:
            return
        self._is_due = True
        self._scheduler.post(self._owner, self.publish)

    def publish(self) -> None:
        """Send all statuses."""
        self._is_due = False
        header = Header(stamp=to_time(self._clock.stamp()))
        self._publisher(DiagnosticArray(header=header, status=tuple(self._statuses.values())))
