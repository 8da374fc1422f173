"""One component in its host: lifecycle state, ports, steps, timers."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from typing import Any, Protocol

from rbxcompose.base.clock import Clock
from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, Query, Refused, Request, as_data, to_data
from rbxcompose.base.scheduler import Periodic, Scheduler
from rbxcompose.bus.actions import ActionServer
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.names import admin_key, resolve
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.runtime.channel import Repeated
from rbxcompose.runtime.faults import explain
from rbxcompose.runtime.process_group.live_ports import Frames, bind, subscribe
from rbxcompose.runtime.process_group.worker import ACTIVATE, CONFIGURE, HandedOver, Worker, handed_over
from rbxcompose.sdk.bound import Window
from rbxcompose.sdk.component import BusAddress, Component, MissionOver, RobotEvent, RobotHeld
from rbxcompose.sdk.ports import In, Port, Qos, ServesAction, ServesTopic
from rbxcompose.sdk.registry import component_type
from rbxcompose.sdk.updater import DiagnosticTask

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


LONGEST_GOODBYE = 0.3  # [s] to wait for a component's own thread to end


class Lifecycle(StrEnum):
    """Lifecycle states, as `ps` shows them."""

    UNCONFIGURED = "unconfigured"
    INACTIVE = "inactive"
    ACTIVE = "active"
    FAILED = "failed"


class ServesParameters(Protocol):
    """Serves the settings of an instance as parameters of ROS 2."""

    def serve(self, hosted: Hosted, /) -> None:
        """Serve the parameters of an instance."""
        ...


class InstanceHome(Protocol):
    """The host of an instance, as the instance sees it."""

    plan: Plan
    clock: Clock
    bus: Bus
    scheduler: Scheduler
    statuses: Statuses
    frames: Frames | None
    router: str
    is_stopped: bool
    is_held: bool
    is_braking: bool
    is_restart: bool
    starts_mission: bool
    has_started: bool
    doing: str

    def stop(self) -> None:
        """Hold everything that moves."""
        ...

    @property
    def notify(self) -> Callable[[Repeated | RobotEvent], None]:
        """Return the function that notifies the supervisor."""
        ...

    @property
    def parameters(self) -> ServesParameters:
        """Return the server of parameters."""
        ...

    def worker(self, name: str, configures_within: float) -> Worker | None:
        """Return a thread for an instance that may block; None if it runs in the scheduler's thread."""
        ...

    def ready(self, name: str) -> None:
        """Handle that an instance has become inactive."""
        ...

    def changed(self, name: str) -> None:
        """Handle a change of the state of an instance."""
        ...

    def log(self, source: str, level: Level, text: str, detail: str = "") -> None:
        """Write one event of the robot's story."""
        ...

    def ask(self, instance: str, request: Request[Any]) -> Any:
        """Return an instance's answer to a request."""
        ...


class Hosted:
    """An instance and, while it lives, its component. It is the component's context, too."""

    def __init__(self, host: InstanceHome, instance: Instance) -> None:
        self.host, self.instance = host, instance
        self.clock: Clock = host.clock
        self.state = Lifecycle.UNCONFIGURED
        self.config = instance.config  # the current one: parameters may have changed it
        self.component: Component[Any] | None = None
        self.worker: Worker | None = None  # the thread of a component that may block
        self._ends: dict[str, Any] = {}  # of the ports, on the bus
        self._claiming: list[Any] = []  # those ports that serve an action which claims a part of the robot
        self._repeated: Sequence[Command] = ()  # requests that it gets again after a restart in place
        self.is_again = False  # the component was already started since the robot came up
        self._was_started = False
        self._wakes: set[float] = set()  # robot times [s] at which to wake the component

    @property
    def file(self) -> str | None:
        """Return the file that defines the component's type."""
        return sys.modules[component_type(self.instance.type).__module__].__file__

    # Lifecycle

    def configure(self) -> None:
        """Create the component, bind its ports, and configure it."""
        cls = component_type(self.instance.type)
        self.worker = self.host.worker(self.instance.name, cls.configures_within) if cls.blocking else None
        self.is_again = self.host.is_restart or self._was_started
        made = cls(self.instance.name, self.config, self if self.worker is None else HandedOver(self, self.worker))
        self.component = made
        self.host.statuses.forget_tasks(self.instance.name)
        bind(made, self.instance, self.host.bus, self.host.frames, self)
        self._ends = dict(made.bound)
        ports = cls.ports(self.config)
        self._claiming = [
            end
            for name, end in made.bound.items()
            if isinstance(port := ports[name], ServesAction) and port.claims and not port.is_elsewhere
        ]
        if self.worker is not None:
            made.bound = {name: handed_over(end, ports[name], self.worker) for name, end in self._ends.items()}
        if cls.has_parameters:
            self.host.parameters.serve(self)
        self.do(CONFIGURE, made.configure, then=self._configured)

    def _configured(self) -> None:
        self._enter(Lifecycle.INACTIVE)
        self.host.statuses.set(self.instance.name, Level.OK, "ready", {})
        if self.worker is not None:
            self.host.ready(self.instance.name)

    def reconfigure(self, config: Config) -> None:
        """Apply another configuration to the component; if it raises, the old one stays."""
        if self.is_busy:
            raise Refused(f"'{self.instance.name}' is busy")
        component, old = self._made(), self.config
        component.config = config
        try:
            component.reconfigure(old)
        except BaseException:
            component.config = old
            raise
        self.config = config

    def activate(self) -> None:
        """Activate the component; like the others, it learns that the robot has started, is stopped or goes down."""
        component = self._made()
        self.host.statuses.set(self.instance.name, Level.OK, "active", {})
        self.do(ACTIVATE, component.activate, then=self._activated)

    def _activated(self) -> None:
        component = self._made()
        self._enter(Lifecycle.ACTIVE)
        if (rate := component.rate_of(component.config)) > 0:
            self._step_with(component, rate)
        if self.host.is_stopped:
            self.do("stop", component.stop)
        if self.host.is_held:
            self.do("hold", component.hold)
        if self.host.is_braking:
            self.do("brake", component.brake)
        if self.host.has_started:
            self.do("start", component.start)
            self.note_start()
            for request in self._repeated:
                self.do("command", partial(self._repeat, component, request, self._repeated))
        self.host.bus.open(self.instance.name)  # those who found it before it was active have waited

    def note_start(self) -> None:
        """Note that the component, if it is active, was told of the start."""
        self._was_started = self._was_started or self.state is Lifecycle.ACTIVE

    def _step_with(self, component: Component[Any], rate: float) -> None:
        scheduler, owner, period, step = self.host.scheduler, self.instance.name, 1.0 / rate, component.step

        def run(dt: float) -> None:
            self.do("step", lambda: step(dt), depth=1)

        if component.steps_for_goals:
            servers = [end for end in self._ends.values() if isinstance(end, ActionServer)]
            GoalSteps(scheduler, owner, period, run, servers)
        else:
            scheduler.every(period, owner, run)

    def close(self) -> None:
        """Deactivate and clean up, as far as it got, and release its ports."""
        self.host.scheduler.remove(self.instance.name)
        component, state = self.component, self.state
        try:
            if component and self._taken_back(component) and state is Lifecycle.ACTIVE:
                component.deactivate()
            if component and self.worker is None and state in (Lifecycle.ACTIVE, Lifecycle.INACTIVE):
                component.cleanup()
        finally:
            self.abandon()
            self.host.bus.close_owner(self.instance.name)

    def abandon(self) -> None:
        """Drop the component without calling it again; what it holds is released, in its own thread if it has one."""
        worker, component = self.worker, self.component
        self.component = self.worker = None
        if worker is not None:
            in_turn = partial(worker.post, self.instance.name)
            worker.close(0.0, partial(self._release, component, in_turn) if component else None)
        elif component is not None:
            self._release(component, lambda call: call())
        self._claiming = []
        self._wakes.clear()
        self.state = Lifecycle.UNCONFIGURED

    def _release(self, component: Component[Any], in_turn: Callable[[Callable[[], None]], None]) -> None:
        try:
            component.at_end.close()
        except (Exception, SystemExit) as error:  # whatever it raises, all the rest has been released
            words, detail = explain(error, self.file)
            in_turn(partial(self.host.log, self.instance.name, Level.WARN, f"not all is released: {words}", detail))

    def _taken_back(self, component: Component[Any]) -> bool:
        """Return the component to the scheduler's thread; return whether its own thread has let go of it."""
        if self.worker is None:
            return True
        label, _ = self.worker.busy_for()
        if not self.worker.close(LONGEST_GOODBYE):
            self.host.log(self.instance.name, Level.WARN, f"does not return from {label}: it is left behind")
            return False
        self.worker, component.context, component.bound = None, self, self._ends
        return True

    def do(
        self, label: str, call: Callable[[], None], *, depth: int | None = None, then: Callable[[], None] | None = None
    ) -> None:
        """Run a call of the component, now or, if it has a thread, there; `then` follows in the scheduler's thread.

        Of waiting calls with the same label, the newest `depth` are kept.
        """
        worker = self.worker
        if worker is not None:
            worker.submit(label, call if then is None else partial(_in_turn, call, partial(worker.send, then)), depth)
            return
        self.host.doing = label
        call()
        if then is not None:
            then()

    @property
    def is_busy(self) -> bool:
        """Return whether the component is in a call in its own thread, so that no other thread must use it."""
        return self.worker is not None and self.worker.is_busy

    def has_to(self, label: str) -> bool:
        """Return whether such a call of the component has been handed to its own thread and has not returned."""
        return self.worker is not None and self.worker.has_to(label)

    @property
    def moves(self) -> str:
        """Return in words how it moves the robot or is about to; empty if it does not."""
        component = self.component
        if component is None or self.state is not Lifecycle.ACTIVE:
            return ""
        if not component.is_at_rest:
            return f"'{self.instance.name}' moves"
        if any(server.current is not None for server in self._claiming):
            return f"'{self.instance.name}' carries out a goal"
        return component.occupation if component.claims else ""

    def cancel_claimed(self) -> None:
        """Request the end of the goals that claim a part of the robot."""
        for server in self._claiming:
            server.cancel_all()

    def refusal(self, port: Port[Any]) -> str:
        """Return why a message, request or goal cannot be taken now; empty if it can."""
        if self.state is not Lifecycle.ACTIVE:
            return f"'{self.instance.name}' is not active"
        is_claiming = isinstance(port, ServesAction | ServesTopic) and bool(port.claims)
        if is_claiming and self.host.is_braking:
            return "the robot is going down"
        if is_claiming and self.host.is_stopped:
            return "the robot is stopped"
        if isinstance(port, ServesAction) and self.is_busy and hasattr(self.component, f"accept_{port.name}"):
            return f"'{self.instance.name}' is busy"
        return ""

    def _made(self) -> Component[Any]:
        if self.component is None:
            raise RuntimeError(f"'{self.instance.name}' is not configured")
        return self.component

    def _enter(self, state: Lifecycle) -> None:
        self.state = state
        self.host.changed(self.instance.name)

    # The component's context

    @property
    def is_stopped(self) -> bool:
        """Return whether the robot is held by a stop."""
        return self.host.is_stopped

    @property
    def starts_mission(self) -> bool:
        """Return whether the mission of `start` is to start."""
        return self.host.starts_mission

    @property
    def is_over(self) -> bool:
        """Return whether nobody waits any more: never for what runs in the scheduler's thread."""
        return False

    @property
    def address(self) -> BusAddress:
        """Return where the robot is on the bus."""
        bus = self.host.plan.bus
        return BusAddress(self.host.plan.robot, self.host.router, bus.domain, bus.namespace, bus.wire)

    def log(self, level: Level, text: str) -> None:
        """Write one event of the robot's story."""
        self.host.log(self.instance.name, level, text)

    def status(self, level: Level, message: str, values: Mapping[str, object]) -> None:
        """Report the component's state to diagnostics."""
        made = self.component
        self.host.statuses.set(self.instance.name, level, message, values, made.hardware_id if made is not None else "")

    def watch(self, name: str, task: DiagnosticTask) -> None:
        """Report how `task` stands to diagnostics, once a second while the component is active."""
        self.host.statuses.watch(self.instance.name, name, task)

    def wake_at(self, time: float) -> None:
        """Call the component's `wake` at robot time `time` [s]."""
        time = max(time, self.clock.now())
        if time not in self._wakes:  # a wake that requests the next one would otherwise multiply
            self._wakes.add(time)
            self.host.scheduler.at(time, self.instance.name, lambda: self._wake(time))

    def _wake(self, time: float) -> None:
        self._wakes.discard(time)
        self.do("wake", self._made().wake)

    def notify(self, event: RobotEvent) -> None:
        """Report something that concerns the whole robot to the supervisor; what must stop stops here at once."""
        if isinstance(event, RobotHeld) and event.reason:
            self.host.scheduler.at(self.clock.now(), self.instance.name, self.host.stop)
        self.host.starts_mission &= not isinstance(event, MissionOver)
        self.host.notify(event)

    def repeat(self, requests: Sequence[Command]) -> None:
        """Send these to the component again after it, or its process, was restarted."""
        self._repeated = requests
        self.host.notify(Repeated(self.instance.name, [as_data(request) for request in requests]))

    def window(self, path: str, question: Query[Any]) -> Window:
        """Open a window for tools outside at `path` of the robot's own keys."""
        name = self.instance.name
        key = admin_key(self.host.plan.robot, path)
        return self.host.bus.window(name, key, lambda: to_data(self.host.ask(name, question)))

    def listen(self, port: In[Any]) -> None:
        """Subscribe to the topic of an input, instead of what its name had before."""
        try:
            topic = resolve(port.topic, self.host.plan.bus.namespace)
        except ValueError as error:
            raise Refused(str(error)) from error
        if any(wire.topic == topic for wire in self.instance.wires if wire.kind == "out"):
            raise Refused(f"'{self.instance.name}' publishes on '{topic}' itself")
        self.mute(port.name)
        component, name = self._made(), self.instance.name
        self._ends[port.name] = component.bound[port.name] = subscribe(
            component, name, topic, port, self.host.bus, self
        )

    def mute(self, name: str) -> None:
        """End the subscription of an input."""
        end = self._ends.pop(name, None)
        self._made().bound.pop(name, None)
        if end is not None:
            self.host.bus.withdraw(self.instance.name, end)

    def _repeat(self, component: Component[Any], request: Command, requests: Sequence[Command]) -> None:
        try:
            component.handle(request)
        except Refused as refusal:
            self.log(Level.WARN, f"{request.words}: {refusal}")
        except Exception:  # it must not fail again at each restart
            self.repeat([one for one in requests if one is not request])
            raise


def _in_turn(*calls: Callable[[], None]) -> None:
    for call in calls:
        call()
