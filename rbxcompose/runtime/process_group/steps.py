"""The steps of a component: at its rate, or only while it has a goal, so that a robot that waits need not wake up."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Protocol

from rbxcompose.scheduler import Periodic, Scheduler

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
