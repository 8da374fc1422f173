"""Faults in the messages that a process receives: refused messages, silent and mismatched publishers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rbxcompose.bus.bus import Bus
from rbxcompose.bus.refusals import sentence
from rbxcompose.bus.topics import Subscription
from rbxcompose.clock import Clock
from rbxcompose.levels import Level
from rbxcompose.runtime.process_group.statuses import Statuses
from rbxcompose.scheduler import Scheduler

PERIOD = 1.0  # [s] between two checks


class Deliveries:
    """Checks each subscription once a second; an unhealthy one has a status `component: topic`."""

    def __init__(self, owner: str, bus: Bus, scheduler: Scheduler, clock: Clock, statuses: Statuses) -> None:
        self._bus, self._clock, self._statuses = bus, clock, statuses
        self._every: Callable[[], object] = lambda: scheduler.every(PERIOD, owner, lambda dt: self._look())
        self._writers = bus.watch_writers(owner)
        self._started = 0.0  # [s]
        self._told: set[str] = set()  # names of unhealthy statuses

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
        for name in self._told - troubled:
            self._statuses.set(name, Level.OK, "messages arrive as they should", {})
        self._told = troubled

    def _trouble(self, subscription: Subscription[Any]) -> str:
        if news := subscription.refusals.news():
            return sentence(subscription.route[0], news)
        return self._writers.trouble(subscription.reader, self._clock.now(), self._started)
