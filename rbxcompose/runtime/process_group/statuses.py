"""The diagnostic statuses of a process: published once a second, and immediately when a level changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from rbxcompose.bus.bus import Bus
from rbxcompose.clock import Clock
from rbxcompose.dataclass import dataclass
from rbxcompose.diagnostics.updater import DiagnosticTask
from rbxcompose.levels import Level
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.qos import Qos
from rbxcompose.scheduler import Scheduler

PERIOD = 1.0  # [s] between two reports
TOPIC = "/diagnostics"


@dataclass(frozen=True, slots=True)
class _Slow:
    """How many callbacks of a component have held up its process, and the longest of them [s]."""

    number: int = 0
    longest: float = 0.0
    callback: str = ""

    def values(self) -> tuple[KeyValue, ...]:
        slowest = f"{self.callback}, {1000 * self.longest:.0f} ms"
        return KeyValue(key="slow_callbacks", value=str(self.number)), KeyValue(key="slowest_callback", value=slowest)


class Statuses:
    """The last status of each component of a process."""

    def __init__(self, owner: str, bus: Bus, scheduler: Scheduler, clock: Clock) -> None:
        self._owner, self._scheduler, self._clock = owner, scheduler, clock
        self._publisher = bus.publisher(owner, TOPIC, DiagnosticArray, Qos.STATE)
        self._statuses: dict[str, DiagnosticStatus] = {}
        self._blocked: dict[str, str] = {}
        self._busy: dict[str, str] = {}
        self._slow: dict[str, _Slow] = {}
        self._tasks: dict[str, dict[str, DiagnosticTask]] = {}  # by component and name
        self.is_active: Callable[[str], bool] = lambda name: True  # tells whose tasks are asked
        self._is_due = False
        scheduler.every(PERIOD, owner, lambda dt: self._report())

    def set(self, name: str, level: Level, message: str, values: Mapping[str, object], hardware_id: str = "") -> None:
        """Keep a status; publish it at this instant if its level is new."""
        before = self._statuses.get(name)
        pairs = tuple(KeyValue(key=key, value=str(value)) for key, value in values.items())
        self._statuses[name] = DiagnosticStatus(
            level=int(level), name=name, message=message, hardware_id=hardware_id, values=pairs
        )
        if before is None or before.level != level:
            self._publish_soon()

    def forget(self, name: str) -> None:
        """Stop reporting on a component that no longer exists."""
        for known in (self._statuses, self._busy, self._slow):
            known.pop(name, None)
        self.forget_tasks(name)

    def watch(self, component: str, name: str, task: DiagnosticTask) -> None:
        """Ask `task` once a second while the component is active, and report it as `component: name`."""
        self._tasks.setdefault(component, {})[name] = task

    def forget_tasks(self, component: str) -> None:
        """Ask the tasks of a component no more."""
        for name in self._tasks.pop(component, {}):
            self._statuses.pop(f"{component}: {name}", None)

    def block(self, causes: Mapping[str, str]) -> None:
        """Show exactly these components as blocked, at least as a warning, whatever their own status."""
        self._blocked = dict(causes)
        self._publish_soon()

    def busy(self, name: str, text: str) -> None:
        """Show a component that does not return from a call with at least a warning; an empty text clears it."""
        if text == self._busy.get(name, ""):
            return
        if bool(text) is not (name in self._busy):
            self._publish_soon()
        if text:
            self._busy[name] = text
        else:
            del self._busy[name]

    def slow(self, name: str, callback: str, seconds: float) -> None:
        """Count a callback that held up the process for `seconds`, and name the longest."""
        before = self._slow.get(name, _Slow())
        longest = max((before.longest, before.callback), (seconds, callback))
        self._slow[name] = _Slow(before.number + 1, *longest)

    def _report(self) -> None:
        now = self._clock.now()
        for component, tasks in self._tasks.items():
            for name, task in tasks.items():
                if self.is_active(component):
                    told = task(now)
                    self.set(f"{component}: {name}", told.level, told.message, told.values)
                else:
                    self._statuses.pop(f"{component}: {name}", None)
        self.publish()

    def _publish_soon(self) -> None:
        if not self._is_due:
            self._is_due = True
            self._scheduler.post(self._owner, self._publish_due)

    def _publish_due(self) -> None:
        if self._is_due:  # else it was published meanwhile
            self.publish()

    def _shown(self, status: DiagnosticStatus) -> DiagnosticStatus:
        cause = self._blocked.get(status.name) or self._busy.get(status.name)
        slow = self._slow.get(status.name)
        if cause is None and slow is None:
            return status
        level = status.level if cause is None else max(status.level, int(Level.WARN))
        values = (*status.values, *(slow.values() if slow is not None else ()))
        return replace(status, level=level, message=cause or status.message, values=values)

    def publish(self) -> None:
        """Send all statuses."""
        self._is_due = False
        header = Header(stamp=to_time(self._clock.stamp()))
        self._publisher(DiagnosticArray(header=header, status=tuple(map(self._shown, self._statuses.values()))))
