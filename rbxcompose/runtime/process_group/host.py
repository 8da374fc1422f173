"""The host of a process: takes its components through their lifecycle, binds their ports and isolates their faults."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from functools import partial
from typing import Any, TypeVar, cast

from rbxcompose.base.clock import Clock
from rbxcompose.base.config import Config, leaves, value_at, with_values
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, OutsideError, Query, Refused, Request, UnreadableError, as_data, to_data
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.actions import ActionServer
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.local import RefusalReason, sentence
from rbxcompose.bus.names import admin_key, resolve
from rbxcompose.bus.services import ServedRequest
from rbxcompose.bus.topics import Subscription
from rbxcompose.bus.wire import queue_depth
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.missions.sources import PAUSE
from rbxcompose.msgs.rcl_interfaces import Log
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.runtime.channel import Failed, Repeated, SettingsKept, States
from rbxcompose.runtime.faults import RestartPolicy, explain
from rbxcompose.runtime.log import Record, WriteRecord
from rbxcompose.runtime.process_group.parameters import NOBODY_ELSE, Deciders, Parameters
from rbxcompose.runtime.process_group.provided import Frames, GoalSteps, Lookup, Statuses, paced
from rbxcompose.runtime.process_group.worker import ACTIVATE, CONFIGURE, Call, HandedOver, Post, Worker, handed_over
from rbxcompose.sdk import ports
from rbxcompose.sdk.bound import Later, Window
from rbxcompose.sdk.capabilities import RunsMissions
from rbxcompose.sdk.component import BusAddress, Component, MissionOver, RobotEvent, RobotHeld
from rbxcompose.sdk.ports import In, Looks, Port, Qos, ServesAction, ServesTopic
from rbxcompose.sdk.registry import component_type, declared
from rbxcompose.sdk.updater import DiagnosticTask

TOPIC = "/rosout"
_LEVELS = {Level.OK: Log.INFO, Level.WARN: Log.WARN, Level.ERROR: Log.ERROR, Level.STALE: Log.WARN}


class Rosout:
    """Publishes what the components of one process log."""

    def __init__(self, owner: str, bus: Bus, clock: Clock) -> None:
        self._clock = clock
        self._publisher = bus.publisher(owner, TOPIC, Log, Qos.EVENT)

    def publish(self, name: str, level: Level, text: str) -> None:
        """Publish one line of the component `name`."""
        self._publisher(Log(stamp=to_time(self._clock.stamp()), level=_LEVELS[level], name=name, msg=text))


PERIOD = 1.0  # [s] between two checks


class Deliveries:
    """Checks each subscription once a second; an unhealthy one has a status `component: topic`."""

    def __init__(self, owner: str, bus: Bus, scheduler: Scheduler, clock: Clock, statuses: Statuses) -> None:
        self._bus, self._clock, self._statuses = bus, clock, statuses
        self._every: Callable[[], object] = lambda: scheduler.every(PERIOD, owner, lambda dt: self._look())
        self._writers = bus.watch_writers(owner)
        self._started = 0.0  # [s]
        self._unhealthy: set[str] = set()  # names of unhealthy statuses

    def start(self, *, is_restart: bool) -> None:
        """Begin to check: the whole robot is active, and all publishers may publish.

        In a process that is restarted, what its predecessor complained of may be over: each subscription has a status.
        """
        self._started = self._clock.now()
        self._unhealthy = {self._name(subscription) for subscription in self._bus.subscriptions if is_restart}
        self._every()

    def _name(self, subscription: Subscription[Any]) -> str:
        return f"{subscription.owner}: {subscription.route[0].lstrip('/')}"

    def _look(self) -> None:
        troubled: set[str] = set()
        for subscription in self._bus.subscriptions:
            name = self._name(subscription)
            if text := self._trouble(subscription):
                troubled.add(name)
                refused = subscription.refusals.total
                self._statuses.set(name, Level.WARN, text, {"refused": refused} if refused else {})
        for gate in self._bus.gates:
            if news := gate.refusals.news():
                name = f"{gate.owner}: {gate.name.lstrip('/')}"
                troubled.add(name)
                text = sentence(gate.name, news, "request")
                self._statuses.set(name, Level.WARN, text, {"refused": gate.refusals.total})
        for name in self._unhealthy - troubled:
            self._statuses.set(name, Level.OK, "messages arrive as they should", {})
        self._unhealthy = troubled

    def _trouble(self, subscription: Subscription[Any]) -> str:
        if news := subscription.refusals.news():
            return sentence(subscription.route[0], news)
        return self._writers.trouble(subscription.reader, self._clock.now(), self._started)


A = TypeVar("A")

SLOW = 0.005  # [s] in one callback, after which diagnostics name it: nothing else in the process runs meanwhile

Notice = States | Failed | Repeated | SettingsKept | RobotEvent  # what a host reports to the supervisor on its own
OnOrder = Callable[..., None]  # takes the name of a method of the host, and its arguments


def _nobody(verb: str, *words: object) -> None:
    """Ignore an order."""


class Host:
    """Runs the instances of one process group; all its methods are called from the scheduler's thread."""

    def __init__(
        self,
        plan: Plan,
        instances: Sequence[Instance],
        scheduler: Scheduler,
        clock: Clock,
        bus: Bus,
        log: WriteRecord,
        notify: Callable[[Notice], None],
        *,
        is_stopped: bool = False,
        is_restart: bool = False,
        on_order: OnOrder = _nobody,
        post: Post | None = None,
        deciders: Deciders = NOBODY_ELSE,
        router: str = "",
        stands_until_start: bool = False,
    ) -> None:
        """Take `on_order`, which is called with each order carried out, so that a recording can be replayed.

        If robot time `stands_until_start`, components that fail before are restarted without a pause.
        With `post`, other threads reach the scheduler's; without it, components that may block run in the scheduler's.
        """
        self.plan, self.clock, self.bus, self.scheduler = plan, clock, bus, scheduler
        self.notify, self.router = notify, router
        self._on_order = on_order
        self.is_stopped = is_stopped
        self.is_restart = is_restart
        self.has_started = False
        self.starts_mission = True  # that of `start`: not when it is over, and not because files have changed
        self.is_braking = False
        self.is_held = False  # robot time stands still
        self._log, self._post, self._stands_until_start = log, post, stands_until_start
        self.owner = f"host_{instances[0].process}" if instances else "host"
        self._wanted: set[str] = set()  # components to activate as soon as possible
        self.statuses = Statuses(self.owner, bus, scheduler, clock)
        self._deliveries = Deliveries(self.owner, bus, scheduler, clock, self.statuses)
        self._rosout = Rosout(self.owner, bus, clock)
        self.frames = self._frames(instances)
        self.hosted = {instance.name: Hosted(self, instance) for instance in instances}
        namespace = plan.bus.namespace
        failed = self._fails_soon
        self.parameters = Parameters(self.owner, bus, clock, namespace, self.hosted, failed, deciders, notify)
        self.statuses.is_active = self._is_active
        self._policies = {instance.name: RestartPolicy(instance.restart) for instance in instances}
        self._retired: dict[str, Component[Any]] = {}  # those that another one may replace
        self.at_work: str | None = None  # the component that runs in the scheduler's thread
        self.doing = ""  # what it does
        scheduler.on_error, scheduler.observe = self.failed, self._observed

    def _frames(self, instances: Sequence[Instance]) -> Frames | None:
        looking = (
            port for instance in instances for port in component_type(instance.type).ports(instance.config).values()
        )
        if not any(isinstance(port, Looks) for port in looking):
            return None
        log = partial(self.log, self.owner)
        return Frames(self.owner, self.bus, self.clock, is_patient=self._post is not None, log=log)

    # Lifecycle of the whole process

    def configure(self) -> None:
        """Configure all components; one that raises is restarted later, the others continue."""
        for name in self.hosted:
            self._configure(name)
        self.statuses.publish()

    def activate(self, names: Sequence[str]) -> None:
        """Activate components in this order."""
        self._on_order("activate", *names)
        for name in names:
            self._wanted.add(name)
            if self.hosted[name].state is Lifecycle.INACTIVE:
                self._guarded(name, self.hosted[name].activate)

    def start(self, starts_mission: bool = True) -> None:
        """Start everything that waits for the whole robot to be active, with or without the mission of `start`."""
        self._on_order("start")
        self.has_started, self.starts_mission = True, starts_mission
        self._deliveries.start(is_restart=self.is_restart)
        self._each_active("start")
        for hosted in self.hosted.values():
            hosted.note_start()

    def shutdown(self) -> None:
        """Deactivate and clean up in reverse order; a component that raises does not affect the others."""
        self._on_order("shutdown")
        self.is_braking = True
        for name in reversed(self.hosted):
            self._guarded(name, self.hosted[name].close)

    # Commands

    def stop(self) -> None:
        """Hold everything that moves and cancel the goals that claim it."""
        self._on_order("stop")
        self.is_stopped = True
        for hosted in self.hosted.values():
            hosted.cancel_claimed("the robot was stopped")
        self._each_active("stop")

    def release(self) -> None:
        """Allow motion again."""
        self._on_order("release")
        self.is_stopped = False
        self._each_active("release")

    def hold(self) -> None:
        """Allow no command but rest while robot time stands still."""
        self.is_held = True
        self._each_active("hold")

    def go_on(self) -> None:
        """Allow commands again; all deadlines start over."""
        self.is_held = False
        self._each_active("go_on")

    @property
    def rest_time(self) -> float:
        """Return how long the components may take to come to rest [s]."""
        each = (entry.instance for entry in self.hosted.values())
        return max((component_type(instance.type).rest_time(instance.config) for instance in each), default=0.0)

    def brake(self) -> None:
        """Bring everything to rest for good: the robot goes down."""
        self._on_order("brake")
        self.is_braking = True
        for hosted in self.hosted.values():
            hosted.cancel_claimed("the robot goes down")
        self._each_active("brake")

    def lost(self, names: Sequence[str], cause: str) -> None:
        """Tell the components that those of another process are gone."""
        self._on_order("lost", cause, *names)
        self._each_active("lost", tuple(names), cause)

    def request(self, instance: str, data: object) -> Request[Any]:
        """Return the request that data represent.

        Raises:
            Refused: if the component does not take such a request, or the data cannot be read.
        """
        if (hosted := self.hosted.get(instance)) is None:
            raise Refused(f"'{instance}' is not active")
        try:
            return component_type(hosted.instance.type).requests().from_data(data)
        except UnreadableError as error:
            raise Refused(f"the request cannot be read: {error}") from error

    def ask(self, instance: str, request: Request[A]) -> A:
        """Return a component's answer to a request.

        Raises:
            Refused: if it cannot be carried out, with the reason.
        """
        if isinstance(request, Command):
            self._on_order("command", instance, as_data(request))
        try:
            return self._idle(instance).handle(request)
        except Refused:
            raise
        except (Exception, SystemExit) as error:
            self._fails_soon(instance, error)
            raise Refused(f"'{instance}' has failed: {type(error).__name__}: {error}") from error

    def recall(self, instance: str, data: Mapping[str, Any]) -> None:
        """Have a component carry out a request from before a restart of its process, once it is active."""
        if (hosted := self.hosted.get(instance)) is None:
            return
        try:
            request = self.request(instance, data)
        except Refused as refusal:
            hosted.log(Level.WARN, str(refusal))
        else:
            self._guarded(instance, partial(hosted.recall, request))

    def restore(self, instance: str, text: str) -> None:
        """Give a component the settings that it had before its process was restarted."""
        hosted = self.hosted.get(instance)
        if hosted is not None and (reason := self.parameters.restore(hosted, text)):
            hosted.log(Level.WARN, f"has the settings of its manifest again: {reason}")

    def _is_active(self, name: str) -> bool:
        return name in self.hosted and self.hosted[name].state is Lifecycle.ACTIVE

    def _idle(self, instance: str) -> Component[Any]:
        """Return a component that can take a request now."""
        hosted = self.hosted.get(instance)
        if hosted is None or hosted.component is None or hosted.state is not Lifecycle.ACTIVE:
            raise Refused(f"'{instance}' is not active")
        if hosted.is_busy:
            raise Refused(f"'{instance}' is busy")
        return hosted.component

    # Another plan

    def retire(self, names: Sequence[str]) -> None:
        """Bring components to rest, in this order, and forget them."""
        for name in names:
            if (hosted := self.hosted.get(name)) is None:
                continue
            hosted.cancel_claimed("its component is taken away")
            if hosted.component is not None and hosted.state is Lifecycle.ACTIVE:
                self._guarded(name, hosted.component.brake)
            if hosted.component is not None:
                self._retired[name] = hosted.component
            self._guarded(name, hosted.close)
            self._wanted.discard(name)
            self.statuses.forget(name)
            del self.hosted[name], self._policies[name]

    def prepare(self, instances: Sequence[Instance]) -> None:
        """Configure components beside those that run, or in their place."""
        self.retire([one.name for one in instances])
        self.starts_mission &= not any(declared(one.type, one.config, RunsMissions) for one in instances)
        self.frames = self.frames or self._frames(instances)
        for instance in instances:
            self.hosted[instance.name] = Hosted(self, instance)
            self._policies[instance.name] = RestartPolicy(instance.restart)
            self._configure(instance.name)
            old, made = self._retired.pop(instance.name, None), self.hosted[instance.name].component
            if made is not None and type(old) is type(made):
                self._guarded(
                    instance.name, partial(self.hosted[instance.name].do, "take_over", partial(made.take_over, old))
                )
        self._retired.clear()
        self.statuses.publish()

    def consider(self, instances: Sequence[Instance]) -> tuple[list[str], list[str]]:
        """Return what components say about other settings, and why some refuse them."""
        said: list[str] = []
        refused: list[str] = []
        for instance in instances:
            hosted = self.hosted.get(instance.name)
            if hosted is None or hosted.component is None or hosted.state is not Lifecycle.ACTIVE:
                continue
            try:
                said += hosted.component.consider(instance.config)
            except Refused as refusal:
                refused.append(str(refusal))
        return said, refused

    def follow(self, instances: Sequence[Instance], keys: Mapping[str, Sequence[str]]) -> dict[str, str]:
        """Apply the settings of `keys` to components; return the reasons of those that refuse, by name."""
        refused: dict[str, str] = {}
        for instance in instances:
            if (hosted := self.hosted.get(instance.name)) is None:
                continue
            if instance.restart != hosted.instance.restart:
                self._policies[instance.name] = RestartPolicy(instance.restart)
            names = [
                name
                for name, _ in leaves(instance.config)
                for key in keys[instance.name]
                if f"{key}.".startswith(f"{name}.")
            ]
            config = with_values(hosted.config, {name: value_at(instance.config, name) for name in names})
            try:
                self.parameters.change(hosted, config)
            except Refused as refusal:
                refused[instance.name] = f"'{instance.name}' refuses: {refusal}"
                continue
            except (Exception, SystemExit) as error:  # as in a step: the failure of the component alone
                self.failed(instance.name, error)
            hosted.instance, hosted.config = instance, config
        return refused

    def work(self) -> tuple[list[str], dict[str, str]]:
        """Return what moves the robot, and the work of components that a restart would cut off, both in words."""
        moves: list[str] = []
        runs: dict[str, str] = {}

        def look(name: str, hosted: Hosted) -> None:
            if moving := hosted.moves:
                moves.append(moving)
            if hosted.component is not None and hosted.component.occupation:
                runs[name] = hosted.component.occupation

        for name, hosted in self.hosted.items():
            if hosted.state is Lifecycle.ACTIVE:
                self._guarded(name, lambda name=name, hosted=hosted: look(name, hosted))  # type: ignore[misc]
        return moves, runs

    # What is known about the components

    @property
    def is_at_rest(self) -> bool:
        """Return whether everything that the components of this process move is at rest."""
        return all(
            entry.component.is_at_rest and not entry.has_to("brake")
            for entry in self.hosted.values()
            if entry.component
        )

    def summary(self) -> dict[str, dict[str, str]]:
        """Return the components' facts for the summary: instance -> label -> text."""
        facts = {name: entry.component.summary() for name, entry in self.hosted.items() if entry.component}
        return {name: some for name, some in facts.items() if some}

    def states(self) -> dict[str, tuple[str, int]]:
        """Return the state and the number of restarts of each instance."""
        return {name: (entry.state.value, self._policies[name].restarts) for name, entry in self.hosted.items()}

    def log(self, source: str, level: Level, text: str, detail: str = "") -> None:
        """Write one record to the log and to the bus, unless its level is below the configured one."""
        hosted = self.hosted.get(source)
        if hosted is not None and level < hosted.instance.log:
            return
        self._rosout.publish(source, level, text)
        self._log(Record(self.clock.now(), level, source, text, detail))

    def _configure(self, name: str) -> None:
        self._policies[name].begin(self.clock.now())
        self._guarded(name, self.hosted[name].configure)

    def changed(self, name: str) -> None:
        """Report a new state to the supervisor."""
        if self.hosted[name].state is Lifecycle.INACTIVE:
            self._policies[name].ready(self.clock.now())
        self.notify(States({name: self.states()[name]}))

    # Who works

    @property
    def place(self) -> str:
        """Return in words which call of which component the scheduler's thread is in; empty if in none."""
        name = self.at_work
        return f"{self.doing or 'a callback'} of '{name}'" if name in self.hosted else ""

    def worker(self, name: str, configures_within: float) -> Worker | None:
        """Return a thread for a component that may block, or None if all must run in one thread: on a stepped clock."""
        if self._post is None:
            return None
        return Worker(name, self.clock, self._post, partial(self.failed, name), configures_within)

    def ready(self, name: str) -> None:
        """Activate a component that was slow to configure, if its activation was requested meanwhile."""
        if name in self._wanted:
            self._guarded(name, self.hosted[name].activate)

    def look_at_workers(self) -> None:
        """Report components that do not return from a call to diagnostics; those that never do have failed."""
        for name, hosted in list(self.hosted.items()):
            if hosted.worker is not None:
                self.statuses.busy(name, hosted.worker.look())

    def _observed(self, owner: str, callback: Callable[[], None]) -> None:
        began, before = self.clock.now(), self.at_work
        self.at_work, self.doing = owner, ""
        try:  # as `_working` does: this is what the scheduler calls most
            callback()
        finally:
            self.at_work = before
        if (seconds := self.clock.now() - began) > SLOW and owner in self.hosted:
            self.statuses.slow(owner, self.doing or "a callback", seconds)

    def _working(self, name: str, action: Callable[[], None]) -> None:
        before, self.at_work, self.doing = self.at_work, name, ""
        try:
            action()
        finally:
            self.at_work = before

    # Mistakes

    def failed(self, name: str, error: BaseException) -> None:
        """Handle an exception of a component: report it, and restart the component unless it fails too often."""
        if name not in self.hosted:
            raise error
        text, detail = explain(error, self.hosted[name].file)
        self.log(name, Level.ERROR, text, detail)
        self.statuses.set(name, Level.ERROR, text, {})
        self.hosted[name].abandon()
        self.bus.close_owner(name)
        self.scheduler.remove(name)
        stands = self._stands_until_start and not self.has_started
        delay = None if self.is_braking else self._policies[name].after_failure(self.clock.now(), stands=stands)
        self.changed(name)
        if delay is not None:
            hosted = self.hosted[name]
            self.scheduler.at(self.clock.now() + delay, self.owner, lambda: self._restart(name, hosted))
        elif not self.is_braking:
            self._give_up(name, text)

    def _fails_soon(self, name: str, error: BaseException) -> None:
        """Handle an exception of a component after who asked for the call has got an answer."""
        self.scheduler.post(self.owner, lambda: self.failed(name, error))

    def _give_up(self, name: str, text: str) -> None:
        """Leave a component failed; one that failed too often, unlike one that is never restarted, ends the robot."""
        self.hosted[name].state = Lifecycle.FAILED
        if self._policies[name].is_allowed:  # first: else a starting robot would continue without it
            self.notify(Failed(name, f"'{name}' failed too often: {text}", self.clock.now()))
        else:
            self.log(name, Level.WARN, "stays failed: it is never restarted")
        self.changed(name)

    def _restart(self, name: str, hosted: Hosted) -> None:
        if self.is_braking or self.hosted.get(name) is not hosted:
            return  # another one may have taken its place
        self.log(name, Level.WARN, "restarted")
        self._configure(name)
        if name in self._wanted and hosted.state is Lifecycle.INACTIVE:
            self._guarded(name, hosted.activate)

    def _guarded(self, name: str, action: Callable[[], None]) -> None:
        try:
            self._working(name, action)
        except (Exception, SystemExit) as error:  # whatever a plug-in raises is its own failure, and reported as such
            self.failed(name, error)

    def _each_active(self, method: str, *arguments: object) -> None:
        for name, hosted in self.hosted.items():
            component = hosted.component
            if component is not None and hosted.state is Lifecycle.ACTIVE:
                self._guarded(name, partial(hosted.do, method, partial(getattr(component, method), *arguments)))


LONGEST_GOODBYE = 0.3  # [s] to wait for a component's own thread to end


class Lifecycle(StrEnum):
    """Lifecycle states, as `ps` shows them."""

    UNCONFIGURED = "unconfigured"
    INACTIVE = "inactive"
    ACTIVE = "active"
    FAILED = "failed"


class Hosted:
    """An instance and, while it lives, its component. It is the component's context, too."""

    def __init__(self, host: Host, instance: Instance) -> None:
        self.host, self.instance = host, instance
        self.clock: Clock = host.clock
        self.state = Lifecycle.UNCONFIGURED
        self.config = instance.config  # the current one: parameters may have changed it
        self.component: Component[Any] | None = None
        self.worker: Worker | None = None  # the thread of a component that may block
        self._ends: dict[str, Any] = {}  # of the ports, on the bus
        self._claiming: list[Any] = []  # those ports that serve an action which claims a part of the robot
        self._repeated: Sequence[Request[Any]] = ()  # requests that it gets again after a restart in place
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
        bind(self, made)
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

    def recall(self, request: Request[Any]) -> None:
        """Carry out a request from before a restart of the process, now or when the component has become active."""
        self._repeated = (*self._repeated, request)
        if self.state is Lifecycle.ACTIVE:
            self.do("command", partial(self._repeat, self._made(), request, self._repeated))

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

    def cancel_claimed(self, cause: str) -> None:
        """Request the end of the goals that claim a part of the robot."""
        for server in self._claiming:
            server.cancel_all(cause)

    @property
    def send(self) -> Callable[[Call], None]:
        """Return what runs a call in the scheduler's thread: soon, or at once if the component has no other."""
        return _at_once if self.worker is None else self.worker.send

    def refuse(self, name: str, reason: str) -> None:
        """Count a message of an input that the component cannot use, and report the first one."""
        if (end := self._ends.get(name)) is not None:
            end.refuse(RefusalReason.CONTENT, reason)

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

    def repeat(self, requests: Sequence[Request[Any]]) -> None:
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
        component = self._made()
        self._ends[port.name] = component.bound[port.name] = subscribe(self, component, topic, port)

    def mute(self, name: str) -> None:
        """End the subscription of an input."""
        end = self._ends.pop(name, None)
        self._made().bound.pop(name, None)
        if end is not None:
            self.host.bus.withdraw(self.instance.name, end)

    def _repeat(self, component: Component[Any], request: Request[Any], requests: Sequence[Request[Any]]) -> None:
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


def bind(hosted: Hosted, component: Component[Any]) -> None:
    """Fill `component.bound`; incoming data go to its handlers unless there is a reason to refuse them.

    Of an end that a program of others has, there is only the absolute name.
    """
    for name, port in type(component).ports(component.config).items():
        topic = hosted.instance.topic
        component.bound[name] = topic(name) if port.is_elsewhere else _end(hosted, component, name, port)


def subscribe(hosted: Hosted, component: Component[Any], topic: str, port: ports.In[Any]) -> Any:
    """Subscribe to a topic; its messages go to the handler of the port."""
    interface = cast(Any, port.interface)
    return hosted.host.bus.subscribe(
        hosted.instance.name,
        topic,
        interface,
        port.qos,
        _on_message(hosted, component, port.name, port),
        max_rate=port.max_rate,
        limits=port.limits,
        # Like goals: a sender that waits for a listener relies on it, and a latched message does not come again.
        waits=isinstance(port, ServesTopic) or port.qos is Qos.LATCHED,
        is_light=hosted.worker is None,
        may_be_silent=port.may_be_silent,
    )


def _end(hosted: Hosted, component: Component[Any], name: str, port: Port[Any]) -> object:
    bus, instance, interface = hosted.host.bus, hosted.instance, cast(Any, port.interface)
    owner = instance.name
    match port:
        case Looks():
            return _lookup(hosted, port)
        case ports.SendsOrders():
            return bus.orders(owner, instance.topic(name), interface, port.qos, port.servers)
        case ports.Out():
            publisher = bus.publisher(owner, instance.topic(name), interface, port.qos)
            return paced(publisher, port, hosted.clock, hosted.watch)
        case In():
            return subscribe(hosted, component, instance.topic(name), port)
        case ports.Serves():
            serve = _on_request(hosted, component, name, port)
            bus.serve_later(owner, instance.topic(name), interface, serve, waits=True, limits=port.limits)
            return None
        case ports.Calls():
            return bus.client(owner, instance.topic(name), interface)
        case ServesAction():
            topic = instance.topic(name)
            accept = _on_goal(hosted, component, name, port)
            server = bus.serve_action(owner, topic, interface, accept, waits=True, limits=port.limits)
            if port.pausable:
                bus.serve(owner, f"{topic}/{PAUSE}", SetBool, partial(_pause, hosted, server, port))
            return server
        case ports.CallsAction():
            return bus.action_client(owner, instance.topic(name), interface)
        case _:
            raise TypeError(f"'{instance.type}' has a port of an unknown kind: {port!r}")


def _lookup(hosted: Hosted, port: Looks) -> Lookup:
    frames = hosted.host.frames
    if frames is None:
        raise RuntimeError("a process with components that look keeps frames")
    if hosted.worker is not None:
        frames.hurry()
    return Lookup(frames, port.target, port.source)


def _pause(
    hosted: Hosted, server: ActionServer[Any, Any, Any], port: Port[Any], request: SetBool.Request
) -> SetBool.Response:
    """Pause or resume the current goal; while the robot is stopped, nothing resumes."""
    goal = server.current
    if goal is None:
        return SetBool.Response(success=False, message="no goal is being carried out")
    if not request.data and (reason := hosted.refusal(port)):
        return SetBool.Response(success=False, message=reason)
    goal.is_paused = request.data
    return SetBool.Response(success=True)


def _on_message(hosted: Hosted, component: Component[Any], name: str, port: In[Any]) -> Callable[[Any], None]:
    own = getattr(component, f"on_{name}", None)
    handler: Callable[[Any], None] = own if own is not None else partial(component.received, name)
    label, depth, send = f"on_{name}", queue_depth(port.qos), hosted.send

    def handle(message: Any) -> None:
        try:
            handler(message)
        except Refused as refusal:
            send(partial(hosted.refuse, name, str(refusal)))

    def take(message: Any) -> None:
        reason = hosted.refusal(port)
        if not reason:  # else it only stays the newest value, for whoever reads it
            hosted.do(label, partial(handle, message), depth=depth)
        elif isinstance(port, ServesTopic):
            hosted.log(Level.WARN, f"an order to {name} is not carried out: {reason}")

    return take


def _on_request(
    hosted: Hosted, component: Component[Any], name: str, port: Port[Any]
) -> Callable[[ServedRequest[Any, Any]], None]:
    label = f"on_{name}"
    answer = getattr(component, label)

    def serve(request: ServedRequest[Any, Any]) -> None:
        if reason := hosted.refusal(port):
            raise Refused(reason)
        hosted.do(label, partial(_answer, label, request, answer, hosted.send))

    return serve


def _answer(
    label: str, request: ServedRequest[Any, Any], answer: Callable[[Any], Any], send: Callable[[Call], None]
) -> None:
    try:
        response = answer(request.message)
    except Refused as refusal:
        send(partial(request.fail, str(refusal)))
    except (Exception, SystemExit) as error:
        send(partial(request.fail, f"{type(error).__name__}: {error}"))
        raise
    else:
        if isinstance(response, Later):
            response.then(partial(_reply, request, send))
            return
        try:
            _reply(request, send, response)
        except TypeError as error:
            given = "None" if response is None else type(response).__name__
            words = f"{label} returned {given}: {error}"
            send(partial(request.fail, words))
            raise OutsideError(words) from error  # no line of code stands for what is missing in the handler


def _reply(request: ServedRequest[Any, Any], send: Callable[[Call], None], response: Any) -> None:
    request.require(response)  # before another thread sends it: its sender is to blame
    send(partial(request.reply, response))


def _at_once(call: Call) -> None:
    call()


def _on_goal(hosted: Hosted, component: Component[Any], name: str, port: Port[Any]) -> Callable[[Any], str]:
    accept: Callable[[Any], str] = getattr(component, f"accept_{name}", lambda goal: "")
    return lambda goal: hosted.refusal(port) or accept(goal)
