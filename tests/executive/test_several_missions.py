"""Several missions at once: who may begin beside whom, who is meant, what a stop does, how one begins elsewhere."""

from __future__ import annotations

import pytest

from rbxcompose.base.requests import Command, Query
from rbxcompose.missions.execution.requests import (
    CancelMission,
    ListMissions,
    LookAtAll,
    LookAtMission,
    PauseMission,
    ResumeMission,
    RunMission,
    ShowPicture,
)
from rbxcompose.sdk import Outcome, Refused
from rbxcompose.sdk.component import MissionOver
from tests.executive.fake_robot import Robot
from tests.loops import for_all

GO = "do:\n  go_to: dock"
LOOK = "do:\n  scan"
DRIVE = "do:\n  go_to: corner"
GREET = """
inputs:
  times:
    type: count
    default: 2
do:
  repeat: $times
  do:
    - say: hello
    - wait: 1 s
"""
MACHINE = """
machine:
  start: first
  states:
    first:
      do:
        go_to: corner
      next:
        success: second
        failure: failed
    second:
      machine:
        start: inner
        states:
          inner:
            do:
              go_to: corner
            next:
              success: last
              failure: failed
          last:
            do:
              go_to: dock
            next:
              success: finished
              failure: failed
      next:
        success: finished
        failure: failed
"""


def robot_with(**missions: str) -> Robot:
    robot = Robot(GO, start=None, **missions)
    robot.start()
    return robot


def test_two_missions_that_claim_different_parts_run_beside_each_other() -> None:
    robot = robot_with(look=LOOK)
    assert robot.mission.handle(RunMission("test")) == "mission test starts"
    assert robot.mission.handle(RunMission("look")) == "mission look starts"
    robot.advance(0.0)
    assert (len(robot.go_to.goals), len(robot.scan.goals)) == (1, 1)
    robot.scan.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert "0 mission look: success" in robot.lines
    assert robot.mission.missions.names == ["test"]


def test_one_that_needs_what_another_uses_is_refused_with_its_name() -> None:
    robot = robot_with(drive=DRIVE)
    robot.mission.handle(RunMission("test"))
    with pytest.raises(Refused, match="base is in use by test"):
        robot.mission.handle(RunMission("drive"))
    robot.mission.handle(CancelMission("test"))
    robot.mission.handle(RunMission("drive"))
    assert robot.mission.missions.names == ["drive"]


@for_all(
    "command, reason",
    [
        (RunMission("tset"), "the robot has no mission 'tset'"),
        (RunMission("test"), "mission test is already running"),
        (RunMission("greet", {"times": "many"}), "the input 'times' must be a whole number"),
        (RunMission("greet", {"tmes": "1"}), "has no input 'tmes'"),
        (RunMission("greet", start="somewhere"), "there is no machine"),
        (RunMission("machine", start="third"), "base is in use|there is no state"),
        (PauseMission("greet"), "mission greet is not running"),
        (CancelMission("nobody"), "the robot has no mission 'nobody'"),
        (ResumeMission(), "mission test is not paused"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_reason(command: Command, reason: str) -> None:
    robot = robot_with(greet=GREET, machine=MACHINE)
    robot.mission.handle(RunMission("test"))
    with pytest.raises(Refused, match=reason):
        robot.mission.handle(command)


def test_inputs_can_be_given_as_text() -> None:
    robot = robot_with(greet=GREET)
    robot.mission.handle(RunMission("greet", {"times": "1"}))
    robot.advance(1.5)
    assert robot.lines[-1] == "1.4 mission greet: success"


def test_it_may_begin_in_another_state() -> None:
    robot = robot_with(machine=MACHINE)
    with pytest.raises(Refused, match="there is no state 'lst'; states are inner, last"):
        robot.mission.handle(RunMission("machine", start="second.lst"))
    robot.mission.handle(RunMission("machine", start="second.last"))
    robot.advance(0.0)
    assert robot.go_to.goals[0].request.pose.pose.position.x == 0.5
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert robot.lines[-1] == "0 mission machine: success"


def test_each_can_be_paused_by_its_name_and_a_stop_pauses_all() -> None:
    robot = robot_with(look=LOOK)
    robot.mission.handle(RunMission("test"))
    robot.mission.handle(RunMission("look"))
    robot.advance(0.0)
    with pytest.raises(Refused, match="several missions are running: test, look; name one"):
        robot.mission.handle(PauseMission())
    assert robot.mission.handle(PauseMission("look")) == "mission look paused"
    assert not robot.go_to.goals[0].is_cancelled
    robot.is_stopped = True
    robot.mission.stop()
    assert [mission.is_paused for mission in robot.mission.missions] == [True, True]
    with pytest.raises(Refused, match="release it first"):
        robot.mission.handle(ResumeMission("look"))
    robot.is_stopped = False
    robot.mission.handle(ResumeMission("test"))
    robot.advance(0.0)
    assert len(robot.go_to.goals) == 2
    assert [mission.is_paused for mission in robot.mission.missions] == [False, True]


def test_only_the_end_of_the_start_mission_is_told_to_the_supervisor() -> None:
    robot = Robot(GO, look=LOOK)
    robot.start()
    robot.mission.handle(RunMission("look"))
    robot.advance(0.0)
    robot.scan.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert robot.events == []
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert robot.events == [MissionOver("test", "success")]


def test_what_people_began_is_kept_for_a_restart_as_long_as_it_runs() -> None:
    robot = robot_with(look=LOOK)
    robot.mission.handle(RunMission("look"))
    assert list(robot.repeated) == [RunMission("look", is_repeated=True)]
    robot.mission.handle(CancelMission())
    assert list(robot.repeated) == []


def test_ls_tells_how_each_stands_and_what_it_claims() -> None:
    robot = robot_with(look=LOOK, greet=GREET)
    robot.mission.handle(RunMission("look"))
    robot.advance(0.0)
    listed = {one.name: one for one in robot.mission.handle(ListMissions())}
    assert {name: entry.state for name, entry in listed.items()} == {"test": "idle", "look": "running", "greet": "idle"}
    assert {name: list(entry.claims) for name, entry in listed.items()} == {
        "test": ["base"],
        "look": ["head"],
        "greet": ["voice"],
    }


@pytest.mark.parametrize("question", [LookAtMission("nobody"), ShowPicture("nobody"), LookAtAll("test")])
def test_a_question_that_has_no_answer_is_refused(question: Query[object]) -> None:
    with pytest.raises(Refused):
        robot_with().mission.handle(question)


def test_the_log_tells_a_command_as_it_is_typed() -> None:
    request = RunMission("patrol", {"low": "40 %", "rounds": "1"}, "outer.inner")
    assert request.words == "run patrol --set 'low=40 %' --set rounds=1 --from outer.inner"
    assert [PauseMission().words, CancelMission("a b").words] == ["pause", "cancel 'a b'"]
