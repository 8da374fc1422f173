"""Missions with real servers on a bus: outcomes of actions, goals that are held, restarts of the executive."""

from __future__ import annotations

import pytest

from rbxcompose.compiler.model.robot import ends_of
from rbxcompose.compiler.plan.model import Instance, Wire
from rbxcompose.missions.components.mission import Mission
from rbxcompose.missions.execution.requests import PauseMission, ResumeMission, RunMission
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.rbxcompose_msgs import Recharge
from rbxcompose.sdk import Component, Config, ServesAction, component
from rbxcompose.sdk.component import MissionOver
from rbxcompose.testing import Bench
from tests.executive.fake_robot import Robot


@component("toy_scanner")
class Scanner(Component[Config]):
    """Scans for two seconds, not counting the time in which it is held."""

    rate = 10.0
    scan = ServesAction(Recharge, "scan", claims="head", pausable=True)

    def configure(self) -> None:
        """Nothing was scanned."""
        self.steps = 0
        self.goals = 0

    def accept_scan(self, goal: Recharge.Goal) -> str:
        """Count goals."""
        self.goals, self.steps = self.goals + 1, 0
        return ""

    def step(self, dt: float) -> None:
        """Go on, unless it is held."""
        goal = self.scan.current
        if goal is not None and goal.cancel_requested:
            goal.canceled()
        elif goal is not None and not goal.is_paused:
            self.steps += 1
            if self.steps == 20:
                goal.succeeded()


def instance(name: str, cls: type[Component[Config]], config: Config) -> Instance:
    wires = tuple(Wire(end.name, end.port.kind, end.topic, end.type_name) for end in ends_of(name, cls, config, "", {}))
    return Instance(name, cls.type_name, config, "robot", (), wires)


def bench() -> Bench:
    config = Robot("do: scan").mission.config
    scanner = instance("scanner", Scanner, Config())
    return Bench(scanner, instance("mission", Mission, config))  # type: ignore[arg-type]


def goals(robot: Bench) -> int:
    scanner = robot.component("scanner")
    assert isinstance(scanner, Scanner)
    return scanner.goals


def lines(robot: Bench) -> list[str]:
    return [f"{record.time:g} {record.text}" for record in robot.records if record.source == "mission"]


def test_a_goal_that_can_be_held_is_held_and_goes_on_where_it_was() -> None:
    robot = bench()
    robot.advance(1.0)
    robot.host.ask("mission", PauseMission())
    robot.advance(7.0)
    robot.host.ask("mission", ResumeMission())
    robot.advance(2.0)
    assert goals(robot) == 1
    assert lines(robot)[-1].endswith("mission test: success")
    assert 8.9 < float(lines(robot)[-1].split()[0]) < 9.1


def test_a_stop_ends_the_held_goal_and_the_resume_sends_it_again() -> None:
    robot = bench()
    robot.advance(1.0)
    robot.host.stop()
    robot.advance(5.0)
    assert not [event for event in robot.events if isinstance(event, MissionOver)]
    robot.host.release()
    robot.host.ask("mission", ResumeMission())
    robot.advance(2.5)
    assert goals(robot) == 2
    assert lines(robot)[-1].endswith("mission test: success")


def test_an_executive_that_crashed_runs_again_what_people_had_begun() -> None:
    robot = Bench(
        instance("scanner", Scanner, Config()),
        instance("mission", Mission, Robot("do: scan", start=None).mission.config),  # type: ignore[arg-type]
    )
    robot.host.ask("mission", RunMission("test"))
    robot.advance(0.5)
    robot.host.failed("mission", RuntimeError("broken"))
    robot.advance(4.0)
    assert lines(robot).count("0 1 Scan") == 1
    assert lines(robot)[-1].endswith("mission test: success")


def test_an_outcome_needs_a_field_in_the_result() -> None:
    with pytest.raises(ValueError, match="NavigateToPose_Result has no text field 'outcome'"):
        ServesAction(NavigateToPose, "go", outcomes={"blocked": "failure"})
    with pytest.raises(ValueError, match="has no text field"):
        ServesAction(NavigateToPose, "go", outcomes={"blocked": "maybe"})
