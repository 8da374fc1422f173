"""Several missions at once: who may begin beside whom, who is meant, what a stop does, how one begins elsewhere."""

from __future__ import annotations

import json

import pytest

from rbxcompose.executive.words import Words, words_of
from rbxcompose.sdk import Outcome, Refused
from tests.executive.fake_robot import Robot

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
    assert robot.mission.command("run test") == "mission test begins"
    assert robot.mission.command("run look") == "mission look begins"
    robot.advance(0.0)
    assert (len(robot.go_to.goals), len(robot.scan.goals)) == (1, 1)
    robot.scan.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert "0 mission look: success" in robot.lines
    assert robot.mission.missions.names == ["test"]


def test_one_that_needs_what_another_uses_is_refused_with_its_name() -> None:
    robot = robot_with(drive=DRIVE)
    robot.mission.command("run test")
    with pytest.raises(Refused, match="base is in use by test"):
        robot.mission.command("run drive")
    robot.mission.command("cancel test")
    robot.mission.command("run drive")
    assert robot.mission.missions.names == ["drive"]


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("run tset", "the robot has no mission 'tset'"),
        ("run test", "mission test runs already"),
        ("run greet --set times=many", "the input 'times' must be a whole number"),
        ("run greet --set tmes=1", "has no input 'tmes'"),
        ("run greet --from somewhere", "there is no machine"),
        ("run machine --from third", "base is in use|there is no state"),
        ("pause greet", "mission greet is not running"),
        ("cancel nobody", "the robot has no mission 'nobody'"),
        ("run test greet", "one mission at a time"),
        ("run greet --set", "'--set' needs a value"),
        ("run greet --set times", "is no NAME=VALUE"),
        ("resume", "mission test is not paused"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_reason(words: str, reason: str) -> None:
    robot = robot_with(greet=GREET, machine=MACHINE)
    robot.mission.command("run test")
    with pytest.raises(Refused, match=reason):
        robot.mission.command(words)


def test_inputs_can_be_given_as_text() -> None:
    robot = robot_with(greet=GREET)
    robot.mission.command("run greet --set times=1")
    robot.advance(1.5)
    assert robot.lines[-1] == "1.4 mission greet: success"


def test_it_may_begin_in_another_state() -> None:
    robot = robot_with(machine=MACHINE)
    with pytest.raises(Refused, match="there is no state 'lst'; states are inner, last"):
        robot.mission.command("run machine --from second.lst")
    robot.mission.command("run machine --from second.last")
    robot.advance(0.0)
    assert robot.go_to.goals[0].request.pose.pose.position.x == 0.5
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert robot.lines[-1] == "0 mission machine: success"


def test_each_can_be_paused_by_its_name_and_a_stop_pauses_all() -> None:
    robot = robot_with(look=LOOK)
    robot.mission.command("run test")
    robot.mission.command("run look")
    robot.advance(0.0)
    with pytest.raises(Refused, match="several missions are running: test, look; name one"):
        robot.mission.command("pause")
    assert robot.mission.command("pause look") == "mission look paused"
    assert not robot.go_to.goals[0].is_cancelled
    robot.is_stopped = True
    robot.mission.stop()
    assert [one.is_paused for one in robot.mission.missions] == [True, True]
    with pytest.raises(Refused, match="release it first"):
        robot.mission.command("resume look")
    robot.is_stopped = False
    robot.mission.command("resume test")
    robot.advance(0.0)
    assert len(robot.go_to.goals) == 2
    assert [one.is_paused for one in robot.mission.missions] == [False, True]


def test_only_the_end_of_the_start_mission_is_told_to_the_supervisor() -> None:
    robot = Robot(GO, look=LOOK)
    robot.start()
    robot.mission.command("run look")
    robot.advance(0.0)
    robot.scan.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert [one for one in robot.events if one["event"] == "mission_ended"] == []
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert robot.events[-1]["mission"] == "test"


def test_what_people_began_is_kept_for_a_restart_as_long_as_it_runs() -> None:
    robot = robot_with(look=LOOK)
    robot.mission.command("run look")
    assert robot.events[-1] == {"event": "commands", "instance": "mission", "commands": "run look"}
    robot.mission.command("cancel")
    assert robot.events[-1]["commands"] == ""


def test_ls_tells_how_each_stands_and_what_it_claims() -> None:
    robot = robot_with(look=LOOK, greet=GREET)
    robot.mission.command("run look")
    robot.advance(0.0)
    listed = {one["name"]: one for one in json.loads(robot.mission.query("ls"))}
    assert {name: one["state"] for name, one in listed.items()} == {"test": "idle", "look": "running", "greet": "idle"}
    assert {name: one["claims"] for name, one in listed.items()} == {
        "test": ["base"],
        "look": ["head"],
        "greet": ["voice"],
    }


@pytest.mark.parametrize("question", ["", "ls all", "state nobody 0", "state test x", "picture nobody", "log many"])
def test_a_question_that_has_no_answer_is_refused(question: str) -> None:
    with pytest.raises(Refused):
        robot_with().mission.query(question)


def test_words_are_read_as_they_are_written() -> None:
    words = Words("run", "patrol", {"low": "40 %", "rounds": "1"}, "outer.inner")
    assert words_of(words.text) == words
