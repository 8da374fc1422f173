"""Connects changes of live settings with the processes of a robot and with the judge."""

from __future__ import annotations

import os
from collections.abc import Collection
from typing import Protocol

from rbxcompose.plan.model import Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.supervision.conductor import Conductor
from rbxcompose.runtime.supervision.judge import Judge
from rbxcompose.runtime.supervision.setting_changes import SettingChanges, WhenJudged


class _Supervisor(Protocol):
    conductor: Conductor

    def send(self, process: str, message: say.ChannelOrder) -> None: ...


class SettingLine:
    """What changes of settings can do; `changes` are those changes."""

    def __init__(self, supervisor: _Supervisor, judge: Judge) -> None:
        self._supervisor, self._judge = supervisor, judge
        self.changes = SettingChanges(self)

    def plan(self) -> Plan:
        """Return the plan in effect."""
        return self._supervisor.conductor.plan

    def reached(self) -> Collection[str]:
        """Return the processes that take orders; none if the robot goes down."""
        conductor = self._supervisor.conductor
        groups = () if conductor.is_going_down else conductor.plan.groups
        return [name for name in groups if conductor.members[name].is_configured]

    def send(self, process: str, message: say.ChannelOrder) -> None:
        """Send a message to a process."""
        self._supervisor.send(process, message)

    def judge(self, now: list[str], new: list[str], then: WhenJudged) -> None:
        """Ask the judge."""
        conductor = self._supervisor.conductor
        file = os.path.realpath(conductor.plan.file)
        self._judge.ask(conductor.generation, file, conductor.layers, now, new, then)

    def close(self) -> None:
        """End the judge."""
        self._judge.close()
