"""What a process provides for its components: publishers that count, frames, steps for goals, statuses."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from rbxcompose.base.clock import NANOSECONDS as PER_SECOND
from rbxcompose.base.clock import Clock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain
from rbxcompose.base.scheduler import Periodic, Scheduler
from rbxcompose.base.transforms import TransformAnswer, TransformError, TransformTree
from rbxcompose.bus.bus import Bus
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue
from rbxcompose.msgs.poses import transform_of
from rbxcompose.msgs.stamps import NANOSECONDS, to_nanoseconds, to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk import ports
from rbxcompose.sdk.bound import Sender
from rbxcompose.sdk.ports import Qos
from rbxcompose.sdk.updater import CompositeTask, DiagnosticTask, FrequencyTask, StampTask


def paced(sender: Sender[Any], port: ports.Out[Any], clock: Clock, watch: Callable[[str, DiagnosticTask], None]) -> Any:
    """Return `sender`, or one that counts if its port declares a rate."""
    if port.rate is None:
        return sender
    stamps = StampTask() if port.interface is not None and "header" in port.interface.FIELDS else None
    made = _Paced(sender, FrequencyTask(port.rate), stamps, clock)
    watch(port.topic.lstrip("/"), made.task)
    return made


class _Paced:
    """A publisher that counts its messages."""

    def __init__(self, sender: Sender[Any], rate: FrequencyTask, stamps: StampTask | None, clock: Clock) -> None:
        self._sender, self._rate, self._stamps, self._clock = sender, rate, stamps, clock
        self.task = rate.status if stamps is None else CompositeTask(rate.status, stamps.status).status

    @property
    def is_wanted(self) -> bool:
        """Return whether anything would receive a message; a component that asks in vain is as punctual."""
        if not (wanted := self._sender.is_wanted):
            self._rate.tick()
        return wanted

    def __call__(self, message: Any, /) -> None:
        self._rate.tick()
        if self._stamps is not None:
            self._stamps.tick(to_nanoseconds(message.header.stamp) / NANOSECONDS, self._clock.stamp() / NANOSECONDS)
        self._sender(message)


MOST_LOGGED = 20  # things about transforms that are logged


@dataclass(frozen=True, slots=True)
class Lookup:
    """The pose of frame `source` in frame `target`, newest or at a time."""

    frames: Frames
    target: str
    source: str

    def now(self, *, within: float = math.inf) -> Pose2 | None:
        """Return the pose [m, m, rad]; None while the frames are not connected, or if one of them is older [s]."""
        found = self.frames.lookup(self.target, self.source, within)
        return found.to_pose2() if found else None

    def transform(self, *, at: int | None = None) -> Transform3:
        """Return the newest pose, or that at a stamp [ns], interpolated.

        Raises:
            LookupError: if there is none; the text names the frames or the times that there are.
        """
        return self.frames.transform(self.target, self.source, at)

    def newest(self) -> int | None:
        """Return the newest stamp [ns] at which all frames between the two are known; None if they never move.

        Raises:
            LookupError: as `transform`.
        """
        return self.frames.newest(self.target, self.source)


class Frames:
    """Feeds a transform tree from `/tf` and `/tf_static`.

    Poses are published often and looked up rarely. In real time, the process is not woken for each of them: they are
    taken when somebody looks one up. On any other clock it is, so that the order of events at an instant is the same in
    each run.
    """

    def __init__(
        self, owner: str, bus: Bus, clock: Clock, *, is_patient: bool, log: Callable[[Level, str], None]
    ) -> None:
        self.tree = TransformTree()
        self._clock, self._log = clock, log
        self._logged: set[str] = set()
        self._lock = threading.Lock()  # who looks back from another thread must not see a history that changes
        self._moving = bus.subscribe(owner, "/tf", TFMessage, ports.Qos.STATE, self._move, is_patient=is_patient)
        bus.subscribe(owner, "/tf_static", TFMessage, ports.Qos.LATCHED, self._fix)

    def lookup(self, target: str, source: str, within: float = math.inf) -> Transform3 | None:
        """Return the newest pose of frame `source` in frame `target`; None if there is none, or it is older [s]."""
        self._moving.catch_up()
        if within < math.inf and (self.tree.age(target, source, self._clock.now()) or 0.0) > within:
            return None
        return self.tree.lookup(target, source)

    def transform(self, target: str, source: str, at: int | None = None) -> Transform3:
        """Return the newest pose of frame `source` in frame `target`, or that at a stamp [ns].

        Raises:
            TransformError: if there is none.
        """
        self._moving.catch_up()
        with self._lock:
            found = self.tree.lookup(target, source) if at is None else self.tree.lookup_at(target, source, at)
            if found is None:
                raise self.tree.problem(target, source) or TransformError(f"'{source}' has no pose in '{target}'")
        return found

    def newest(self, target: str, source: str) -> int | None:
        """Return the newest stamp [ns] at which all frames between two are known; None if they never move.

        Raises:
            TransformError: if they are not connected.
        """
        self._moving.catch_up()
        with self._lock:
            return self.tree.newest_common(target, source)

    def hurry(self) -> None:
        """Take each pose when it arrives: another thread looks them up and must not take them itself."""
        self._moving.hurry()

    def _fix(self, message: TFMessage) -> None:
        self._take(message, 0.0, static=True)

    def _move(self, message: TFMessage) -> None:
        self._take(message, self._moving.age, static=False)

    def _take(self, message: TFMessage, age: float, *, static: bool) -> None:
        received, unstamped = self._clock.now() - age, self._clock.stamp() - round(age * PER_SECOND)
        with self._lock:
            for transform in message.transforms:
                time = to_nanoseconds(transform.header.stamp) or unstamped
                parent, child, pose = (
                    transform.header.frame_id,
                    transform.child_frame_id,
                    transform_of(transform.transform),
                )
                answer = self.tree.set(parent, child, pose, stamp=received, static=static, measured=time)
                if answer.message:
                    self._log_once(answer)

    def _log_once(self, answer: TransformAnswer) -> None:
        """Log once what is unusual about a transform; after very many such, nothing more."""
        text = plain(answer.message)
        if text in self._logged or len(self._logged) == MOST_LOGGED:
            return
        self._logged.add(text)
        if answer.accepted:
            self._log(Level.OK, text)
        else:
            self._log(Level.WARN, f"a transform is refused: {text}")


ROUNDING = 1e-9  # of a period


class ServesGoals(Protocol):
    """Has goals to carry out, one at a time; whoever wants to know of a new one sets `began`."""

    began: Callable[[], None]

    @property
    def current(self) -> object:
        """Return the goal to carry out, or None."""
        ...


class GoalSteps:
    """Calls `step(dt)` every `period` [s] while one of `servers` has a goal, and once after the last one has ended.

    The instants and `dt` are those of a timer that never rests.
    """

    def __init__(
        self,
        scheduler: Scheduler,
        owner: str,
        period: float,
        step: Callable[[float], None],
        servers: Sequence[ServesGoals],
    ) -> None:
        self._scheduler, self._owner, self._period, self._step = scheduler, owner, period, step
        self._servers = servers
        self._start = self._last = math.floor(scheduler.now / period) * period  # [s]
        self._rests = True
        for server in servers:
            server.began = self._go_on
        if self._has_goal:
            self._go_on()

    @property
    def _has_goal(self) -> bool:
        return any(server.current is not None for server in self._servers)

    def _go_on(self) -> None:
        if self._rests:
            self._rests = False
            self._last = self._plan() - self._period  # when it would have stepped last

    def _plan(self) -> float:
        """Schedule the next step and return its time [s]: the first on the grid that is later than now."""
        now = self._scheduler.now
        cycle = int((now - self._start) / self._period + ROUNDING)
        if self._start + cycle * self._period <= now:
            cycle += 1
        due = self._start + cycle * self._period
        self._scheduler.at(due, self._owner, self._run)
        return due

    def _run(self) -> None:
        now = self._scheduler.now
        dt, self._last = min(now - self._last, Periodic.LONGEST_DT * self._period), now
        self._rests = not self._has_goal
        if not self._rests:
            self._plan()  # before the step, which may raise
        self._step(dt)


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
                    status = task(now)
                    self.set(f"{component}: {name}", status.level, status.message, status.values)
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
