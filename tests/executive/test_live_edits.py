"""Missions that are changed while they run, as `apply` does it."""

from __future__ import annotations

import json

import pytest

from rbxcompose.base.config import Place, with_values
from rbxcompose.base.requests import Refused
from rbxcompose.missions.engine.logbook import OtherInterventionError, replay
from rbxcompose.missions.execution.equipment import MissionConfig
from rbxcompose.missions.execution.requests import (
    ListBreakpoints,
    ListMissions,
    PauseMission,
    ResumeMission,
    RunMission,
    SetBreakpoint,
)
from rbxcompose.sdk import Outcome
from tests.executive.fake_robot import Robot, program_of

BEFORE = "do: [{go_to: dock}, {wait: 2 s}]"


def config_of(robot: Robot, text: str, **others: str) -> MissionConfig:
    programs = {name: program_of(one) for name, one in {"test": text, **others}.items()}
    return with_values(robot.mission.config, {"programs": programs})


def change(robot: Robot, config: MissionConfig) -> list[str]:
    """Let the executive have another configuration; return what it said before."""
    said = list(robot.mission.consider(config))
    old, robot.mission.config = robot.mission.config, config
    robot.mission.reconfigure(old)
    robot.advance(0.0)
    return said


def running(text: str, seconds: float = 0.0, **others: str) -> Robot:
    robot = Robot(text, **others)
    robot.start()
    robot.advance(seconds)
    return robot


def test_a_goal_under_way_is_not_sent_again_and_its_end_counts() -> None:
    robot = running(BEFORE)
    said = change(robot, config_of(robot, "do: [{wait: 1 s}, {go_to: dock}, {wait: 3 s}]"))
    assert said == ["mission test goes on where it is"]
    assert (len(robot.go_to.goals), robot.go_to.goals[0].is_cancelled) == (1, False)
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(3.0)
    assert robot.lines[-1] == "3 mission test: success"
    assert "0 by hand: the robot's missions were changed; the run cannot be reproduced without this" in robot.lines


def test_a_goal_that_changes_is_cancelled_and_sent_again() -> None:
    robot = running(BEFORE)
    said = change(robot, config_of(robot, "do: [{go_to: corner}, {wait: 2 s}]"))
    assert said[1:] == ["mission.yaml:1: 'go_to corner' runs and has changed: it begins again"]
    assert (len(robot.go_to.goals), robot.go_to.goals[0].is_cancelled) == (2, True)
    assert "0 go_to dock: halted (0 s): the mission was changed" in robot.lines


def test_what_would_be_gone_is_refused_and_the_mission_goes_on() -> None:
    robot = running(BEFORE)
    for config in (config_of(robot, "do: {wait: 2 s}"), with_values(robot.mission.config, {"programs": {}})):
        with pytest.raises(
            Refused, match=r"mission test cannot go on: .*'go_to dock' runs|mission test runs, and would"
        ):
            list(robot.mission.consider(config))
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(2.0)
    assert robot.lines[-1] == "2 mission test: success"


def test_a_mission_that_would_need_an_input_is_refused() -> None:
    robot = running(BEFORE)
    config = config_of(robot, "inputs: {n: {type: number}}\ndo: [{go_to: dock}, {wait: 2 s}, {log: $n}]")
    with pytest.raises(Refused, match="the input 'n' of the mission"):
        list(robot.mission.consider(config))


def test_two_missions_may_not_come_to_need_the_same_part_of_the_robot() -> None:
    robot = running("do: [{wait: 9 s}]", other="do: [{go_to: dock}]")
    robot.mission.handle(RunMission("other"))
    robot.advance(0.5)
    with pytest.raises(Refused, match="missions test and other run, and both would use base"):
        list(robot.mission.consider(config_of(robot, "do: [{wait: 9 s}, {go_to: dock}]", other="do: [{go_to: dock}]")))


def test_a_place_that_moves_counts_for_what_begins_later() -> None:
    robot = running("do: [{go_to: dock}, {go_to: corner}]")
    places = {**robot.mission.config.places, "corner": Place("corner", 7.0, 8.0, 0.0)}
    change(robot, with_values(robot.mission.config, {"places": places}))
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert [goal.request.pose.pose.position.x for goal in robot.go_to.goals][1:] == [7.0]


def test_a_mission_that_does_not_run_is_the_changed_one_the_next_time() -> None:
    robot = running(BEFORE, other="do: {log: before}")
    change(robot, config_of(robot, BEFORE, other="do: {log: after}", fresh="do: {log: new}"))
    for name, line in (("other", "other: after"), ("fresh", "fresh: new")):
        robot.mission.handle(RunMission(name))
        robot.advance(0.0)
        assert f"0 {line}" in robot.lines
    assert {"missions/other", "missions/fresh"} <= robot.windows.keys()


def test_breakpoints_follow_their_nodes() -> None:
    robot = running("do:\n  - go_to: dock\n  - wait: 2 s\n  - wait: 3 s\n")
    robot.mission.handle(SetBreakpoint("mission.yaml:3"))
    robot.mission.handle(SetBreakpoint("mission.yaml:4"))
    change(robot, config_of(robot, "# more\ndo:\n  - go_to: dock\n  - log: hi\n  - wait: 2 s\n"))
    assert [one.place for one in robot.mission.handle(ListBreakpoints())] == ["mission.yaml:5"]
    assert "0 the breakpoint at 'test: mission.yaml:4' is gone" in robot.lines
    assert robot.repeated == (SetBreakpoint("mission.yaml:5", "test"),)
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert [(one.state, one.at) for one in robot.mission.handle(ListMissions())] == [("paused", "mission.yaml:5")]


def test_a_viewer_gets_the_picture_of_the_changed_mission() -> None:
    robot = running(BEFORE)
    robot.windows["missions/test"].is_watched = True
    robot.mission.broadcast.publish(robot.mission.missions)
    change(robot, config_of(robot, "do: [{go_to: dock}, {log: hi}, {wait: 2 s}]"))
    robot.mission.broadcast.publish(robot.mission.missions)
    news = robot.windows["missions/test"].news[-1]
    assert (news["whole"], news["edition"], news["picture"]["count"]) == (True, 1, 4)


def test_the_log_of_a_changed_run_cannot_be_replayed() -> None:
    robot = running(BEFORE)
    change(robot, config_of(robot, "do: [{go_to: dock}, {wait: 3 s}]"))
    run = robot.mission.missions.runs["test"]
    records = [json.loads(json.dumps(record)) for record in robot.mission.missions.since(0).records]
    with pytest.raises(OtherInterventionError, match="the mission was changed while it ran"):
        replay(records, run.engine.program, run.engine.robot)


def replaced(robot: Robot, text: str) -> Robot:
    """Return a robot with another executive, which took over, as for other ports."""
    robot.mission.brake()
    other = Robot(text)
    other.stepped.advance_to(robot.clock.now())
    other.mission.take_over(robot.mission)
    other.start()
    return other


def test_another_executive_goes_on_with_what_was_paused() -> None:
    robot = running(BEFORE)
    robot.mission.handle(SetBreakpoint("mission.yaml:1"))
    robot.mission.handle(PauseMission())
    other = replaced(robot, "do: [{go_to: dock}, {log: hi}, {wait: 2 s}]")
    assert "0 mission test is where it was, and still paused" in other.lines
    assert other.go_to.goals == []
    assert [one.mission for one in other.mission.handle(ListBreakpoints())] == ["test"]
    other.mission.handle(ResumeMission())
    other.advance(0.0)
    assert len(other.go_to.goals) == 1


def test_another_executive_starts_again_what_cannot_go_on() -> None:
    robot = running(BEFORE)
    robot.mission.handle(PauseMission())
    other = replaced(robot, "do: {wait: 1 s}")
    assert any("mission test cannot go on" in line and line.endswith("it starts again") for line in other.lines)
    other.mission.handle(ResumeMission())
    other.advance(1.0)
    assert other.lines[-1] == "1 mission test: success"
