"""One component in its host: lifecycle state, ports, timers."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from rbxcompose.body.transforms import TransformTree
from rbxcompose.clock import Clock
from rbxcompose.config import Config
from rbxcompose.diagnostics.levels import Level
from rbxcompose.plan.model import Instance
from rbxcompose.runtime.binding import bind
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import Port, ServesAction
from rbxcompose.sdk.registry import component_type

if TYPE_CHECKING:
    from rbxcompose.runtime.host import Host


class State(StrEnum):
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
        self.state = State.UNCONFIGURED
        self.config = instance.config  # as it is now: parameters may have changed it
        self.component: Component[Any] | None = None
        self._wakes: set[float] = set()  # robot times [s] at which the component is to be woken

    @property
    def file(self) -> str | None:
        """Return the file in which the component's type is written."""
        return sys.modules[component_type(self.instance.type).__module__].__file__

    # Lifecycle

    def configure(self) -> None:
        """Make the component, bind its ports, let it get ready."""
        made = component_type(self.instance.type)(self.instance.name, self.config, self)
        tree = self.host.tree.tree if self.host.tree else TransformTree()
        self.component = made
        bind(made, self.instance, self.host.bus, tree, self._refusal)
        self.host.parameters.serve(self)
        made.configure()
        self._enter(State.INACTIVE)
        self.host.statuses.set(self.instance.name, Level.OK, "ready", {})

    def reconfigure(self, config: Config) -> None:
        """Let the component follow another configuration; if it raises, the old one stays."""
        component, old = self._made(), self.config
        component.config = config
        try:
            component.reconfigure(old)
        except BaseException:
            component.config = old
            raise
        self.config = config

    def activate(self) -> None:
        """Let the component work; it joins a robot that has started, is stopped or goes down as the others did."""
        component = self._made()
        self.host.statuses.set(self.instance.name, Level.OK, "active", {})
        component.activate()
        self._enter(State.ACTIVE)
        if component.rate:
            self.host.scheduler.every(1.0 / component.rate, self.instance.name, component.step)
        if self.host.is_stopped:
            component.stop()
        if self.host.has_started:
            component.start()

    def close(self) -> None:
        """Deactivate and clean up, as far as it got, and give back its ports."""
        self.host.scheduler.remove(self.instance.name)
        component, state = self.component, self.state
        try:
            if component and state is State.ACTIVE:
                component.deactivate()
            if component and state in (State.ACTIVE, State.INACTIVE):
                component.cleanup()
        finally:
            self.abandon()
            self.host.bus.close_owner(self.instance.name)

    def abandon(self) -> None:
        """Forget the component as it is."""
        self.component = None
        self._wakes.clear()
        self.state = State.UNCONFIGURED

    def cancel_claimed(self) -> None:
        """Ask the goals that claim a part of the robot to end."""
        if self.component is None:
            return
        for name, port in type(self.component).ports(self.instance.config).items():
            if isinstance(port, ServesAction) and port.claims and name in self.component.bound:
                self.component.bound[name].cancel_all()

    def _refusal(self, port: Port[Any]) -> str:
        if self.state is not State.ACTIVE:
            return f"'{self.instance.name}' is not active"
        if isinstance(port, ServesAction) and port.claims and self.host.is_braking:
            return "the robot is going down"
        if isinstance(port, ServesAction) and port.claims and self.host.is_stopped:
            return "the robot is stopped"
        return ""

    def _made(self) -> Component[Any]:
        if self.component is None:
            raise RuntimeError(f"'{self.instance.name}' is not configured")
        return self.component

    def _enter(self, state: State) -> None:
        self.state = state
        self.host.changed(self.instance.name)

    # The component's context

    @property
    def is_stopped(self) -> bool:
        """Tell whether the robot is held by a stop."""
        return self.host.is_stopped

    def log(self, level: Level, text: str) -> None:
        """Write one event of the robot's story."""
        self.host.log(self.instance.name, level, text)

    def status(self, level: Level, message: str, values: Mapping[str, object]) -> None:
        """Tell diagnostics how the component is."""
        self.host.statuses.set(self.instance.name, level, message, values)

    def wake_at(self, time: float) -> None:
        """Call the component's `wake` at robot time `time` [s]."""
        time = max(time, self.clock.now())
        if time not in self._wakes:  # a wake that asks for the next one would otherwise multiply
            self._wakes.add(time)
            self.host.scheduler.at(time, self.instance.name, lambda: self._wake(time))

    def _wake(self, time: float) -> None:
        self._wakes.discard(time)
        self._made().wake()

    def notify(self, event: str, **data: object) -> None:
        """Tell the supervisor of something that concerns the whole robot."""
        self.host.notify(event, data)
