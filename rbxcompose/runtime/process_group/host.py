"""The host of a process: takes its components through their lifecycle and isolates their faults."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

from rbxcompose.base.clock import Clock
from rbxcompose.base.config import leaves, value_at, with_values
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, Refused, Request, UnreadableError, as_data
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.local import sentence
from rbxcompose.bus.topics import Subscription
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.msgs.rcl_interfaces import Log
from rbxcompose.msgs.stamps import to_time
from rbxcompose.runtime.channel import Failed, Repeated, States
from rbxcompose.runtime.faults import RestartPolicy, explain
from rbxcompose.runtime.log import Record, WriteRecord
from rbxcompose.runtime.process_group.hosted import Hosted, Lifecycle, Statuses
from rbxcompose.runtime.process_group.live_ports import Frames
from rbxcompose.runtime.process_group.parameters import NOBODY_ELSE, Deciders, Parameters
from rbxcompose.runtime.process_group.worker import Post, Worker
from rbxcompose.sdk.capabilities import RunsMissions
from rbxcompose.sdk.component import Component, RobotEvent
from rbxcompose.sdk.ports import Looks, Qos
from rbxcompose.sdk.registry import component_type, declared

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

    def start(self) -> None:
        """Begin to check: the whole robot is active, and all publishers may publish."""
        self._started = self._clock.now()
        self._every()

    def _look(self) -> None:
        troubled: set[str] = set()
        for subscription in self._bus.subscriptions:
            name = f"{subscription.reader.owner}: {subscription.route[0].lstrip('/')}"
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

Notice = States | Failed | Repeated | RobotEvent  # what a host reports to the supervisor on its own
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
    ) -> None:
        """Take `on_order`, which is called with each order carried out, so that a recording can be replayed.

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
        self._log, self._post = log, post
        self.owner = f"host_{instances[0].process}" if instances else "host"
        self._wanted: set[str] = set()  # components to activate as soon as possible
        self.statuses = Statuses(self.owner, bus, scheduler, clock)
        self._deliveries = Deliveries(self.owner, bus, scheduler, clock, self.statuses)
        self._rosout = Rosout(self.owner, bus, clock)
        self.frames = self._frames(instances)
        self.hosted = {instance.name: Hosted(self, instance) for instance in instances}
        namespace = plan.bus.namespace
        self.parameters = Parameters(self.owner, bus, clock, namespace, self.hosted, self._fails_soon, deciders)
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
        self._deliveries.start()
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
            hosted.cancel_claimed()
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
            hosted.cancel_claimed()
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
            hosted.cancel_claimed()
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
        delay = None if self.is_braking else self._policies[name].after_failure(self.clock.now())
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
            self.notify(Failed(name, f"'{name}' failed too often: {text}"))
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
