"""The host of a process: carries its components through their lifecycle and keeps their mistakes apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rbxcompose.bus.bus import Bus
from rbxcompose.clock import Clock
from rbxcompose.diagnostics.levels import Level
from rbxcompose.plan.model import Instance, Plan
from rbxcompose.runtime.faults import RestartPolicy, explain
from rbxcompose.runtime.frames import Frames
from rbxcompose.runtime.hosted import Hosted, State
from rbxcompose.runtime.parameters import Parameters
from rbxcompose.runtime.records import Log, Record
from rbxcompose.runtime.rosout import Rosout
from rbxcompose.runtime.statuses import Statuses
from rbxcompose.scheduler import Scheduler
from rbxcompose.sdk.bound import Refused
from rbxcompose.sdk.ports import Looks
from rbxcompose.sdk.registry import component_type

Notify = Callable[[str, dict[str, object]], None]


class Host:
    """Runs the instances of one process group; all its methods are called from the scheduler's thread."""

    def __init__(
        self,
        plan: Plan,
        instances: Sequence[Instance],
        scheduler: Scheduler,
        clock: Clock,
        bus: Bus,
        log: Log,
        notify: Notify,
        *,
        is_stopped: bool = False,
        is_restart: bool = False,
    ) -> None:
        self.plan, self.clock, self.bus, self.scheduler = plan, clock, bus, scheduler
        self.notify = notify
        self.is_stopped = is_stopped
        self.is_restart = is_restart
        self.has_started = False
        self.is_braking = False
        self._log = log
        self.owner = f"host_{instances[0].process}" if instances else "host"
        self._wanted: set[str] = set()  # to be active, as soon as they can
        self.statuses = Statuses(self.owner, bus, scheduler, clock)
        self.parameters = Parameters(self.owner, bus, clock, plan.bus.namespace)
        self._rosout = Rosout(self.owner, bus, clock)
        self.tree = self._frames(instances)
        self.hosted = {one.name: Hosted(self, one) for one in instances}
        self._policies = {one.name: RestartPolicy(one.restart) for one in instances}
        scheduler.on_error = self.failed

    def _frames(self, instances: Sequence[Instance]) -> Frames | None:
        looking = (port for one in instances for port in component_type(one.type).ports(one.config).values())
        return Frames(self.owner, self.bus, self.clock) if any(isinstance(p, Looks) for p in looking) else None

    # Lifecycle of the whole process

    def configure(self) -> None:
        """Configure all components; one that raises is restarted later, the others go on."""
        for name in self.hosted:
            self._guarded(name, self.hosted[name].configure)
        self.statuses.publish()

    def activate(self, names: Sequence[str]) -> None:
        """Activate components in this order."""
        for name in names:
            self._wanted.add(name)
            if self.hosted[name].state is State.INACTIVE:
                self._guarded(name, self.hosted[name].activate)

    def start(self) -> None:
        """Begin what waits for the whole robot to be active."""
        self.has_started = True
        self._each_active(lambda one: one.start())

    def shutdown(self) -> None:
        """Deactivate and clean up in reverse order; a component that raises does not keep the others."""
        self.is_braking = True
        for name in reversed(self.hosted):
            self._guarded(name, self.hosted[name].close)

    # Commands

    def stop(self) -> None:
        """Hold everything that moves and cancel the goals that claim it."""
        self.is_stopped = True
        for hosted in self.hosted.values():
            hosted.cancel_claimed()
        self._each_active(lambda one: one.stop())

    def release(self) -> None:
        """Allow motion again."""
        self.is_stopped = False
        self._each_active(lambda one: one.release())

    def brake(self) -> None:
        """Bring everything to rest for good: the robot goes down."""
        self.is_braking = True
        for hosted in self.hosted.values():
            hosted.cancel_claimed()
        self._each_active(lambda one: one.brake())

    def lost(self, names: Sequence[str], cause: str) -> None:
        """Tell the components that those of another process have gone."""
        self._each_active(lambda one: one.lost(tuple(names), cause))

    def command(self, instance: str, verb: str) -> str:
        """Give a person's command to a component and return its answer.

        Raises:
            Refused: if it cannot be carried out, with the reason.
        """
        hosted = self.hosted.get(instance)
        if hosted is None or hosted.component is None or hosted.state is not State.ACTIVE:
            raise Refused(f"'{instance}' is not active")
        return hosted.component.command(verb)

    # What is known of the components

    @property
    def is_at_rest(self) -> bool:
        """Tell whether nothing moves that a component of this process moves."""
        return all(one.component.is_at_rest for one in self.hosted.values() if one.component)

    def summary(self) -> dict[str, dict[str, str]]:
        """Return what the components tell for the summary: instance -> label -> text."""
        facts = {name: one.component.summary() for name, one in self.hosted.items() if one.component}
        return {name: some for name, some in facts.items() if some}

    def states(self) -> dict[str, tuple[str, int]]:
        """Return state and number of restarts of each instance."""
        return {name: (one.state.value, self._policies[name].restarts) for name, one in self.hosted.items()}

    def log(self, source: str, level: Level, text: str, detail: str = "") -> None:
        """Write one record, for people and for who listens on the bus."""
        self._rosout.publish(source, level, text)
        self._log(Record(self.clock.now(), level, source, text, detail))

    def changed(self, name: str) -> None:
        """Tell the supervisor of a new state."""
        state, restarts = self.states()[name]
        self.notify("state", {"instance": name, "state": state, "restarts": restarts})

    # Mistakes

    def failed(self, name: str, error: Exception) -> None:
        """Take an exception of a component: tell it, restart the component unless it fails too often."""
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
            self.scheduler.at(self.clock.now() + delay, self.owner, lambda: self._restart(name))
        elif not self.is_braking:
            self._give_up(name, text)

    def _give_up(self, name: str, text: str) -> None:
        """Leave a component as it is; one that failed too often, unlike one that is never restarted, ends the robot."""
        self.hosted[name].state = State.FAILED
        if self._policies[name].is_allowed:  # told first: a robot that starts would go on without what has failed
            self.notify("failed", {"instance": name, "message": f"'{name}' failed too often: {text}"})
        else:
            self.log(name, Level.WARN, "stays failed: it is never restarted")
        self.changed(name)

    def _restart(self, name: str) -> None:
        if self.is_braking:
            return
        hosted = self.hosted[name]
        self.log(name, Level.WARN, "restarted")
        self._guarded(name, hosted.configure)
        if name in self._wanted and hosted.state is State.INACTIVE:
            self._guarded(name, hosted.activate)

    def _guarded(self, name: str, action: Callable[[], None]) -> None:
        try:
            action()
        except Exception as error:  # whatever a plug-in raises is its own failure, and told as such
            self.failed(name, error)

    def _each_active(self, action: Callable[[Any], None]) -> None:
        for name, hosted in self.hosted.items():
            component = hosted.component
            if component is not None and hosted.state is State.ACTIVE:
                self._guarded(name, lambda component=component: action(component))  # type: ignore[misc]
