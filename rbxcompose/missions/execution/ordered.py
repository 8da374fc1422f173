"""A mission that another component runs, by the action `run_mission`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Protocol

from rbxcompose.base.requests import Refused
from rbxcompose.missions.execution.mission_run import MissionRun
from rbxcompose.msgs.rbxcompose_msgs import RunMission
from rbxcompose.sdk.bound import ServedGoal

Order = ServedGoal[RunMission.Goal, RunMission.Result, RunMission.Feedback]


class Begins(Protocol):
    """Begins a mission with inputs as text, and parts of the robot that are lent to it."""

    def __call__(self, name: str, inputs: Mapping[str, str], *, lent: frozenset[str]) -> MissionRun:
        """Begin it.

        Raises:
            Refused: if it cannot run, with the reason.
        """


class OrderedMission:
    """Runs one mission at a time for other components; the newest goal counts."""

    def __init__(
        self, inputs_of: Callable[[str], Collection[str]], begin: Begins, end: Callable[[MissionRun], None]
    ) -> None:
        self._inputs_of, self._begin_mission, self._end_mission = inputs_of, begin, end
        self._goal: Order | None = None
        self._run: MissionRun | None = None

    def step(self, goal: Order | None) -> None:
        """Begin what is wanted now, and report how it ended."""
        if goal is not self._goal:
            self._leave()
            self._goal = goal
            if goal is not None:
                self._begin(goal)
        if goal is None or self._run is None:
            return
        if goal.cancel_requested:
            self._leave()
            goal.canceled()
        elif (end := self._run.end) is not None:
            self._run = None
            told = RunMission.Result(end.words or end.result)
            if end.result == "success":
                goal.succeeded(told)
            else:
                goal.aborted(told.message, told)

    def _begin(self, goal: Order) -> None:
        request, known = goal.request, self._inputs_of(goal.request.mission)
        given = {name: text for name, text in zip(request.inputs, request.values, strict=False) if name in known}
        try:
            self._run = self._begin_mission(request.mission, given, lent=frozenset(request.lends))
        except Refused as refusal:
            goal.aborted(str(refusal), RunMission.Result(str(refusal)))

    def _leave(self) -> None:
        """End the mission of a goal that nobody wants any more."""
        if self._run is not None and not self._run.is_over:
            self._end_mission(self._run)
        self._run = None
