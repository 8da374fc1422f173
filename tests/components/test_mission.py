"""The executive on a fake robot: goals go out, results come in, the story is told."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from rbxcompose.base.expressions.values import NOT_ARRIVED
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.requests import Command
from rbxcompose.missions.components.mission import Mission
from rbxcompose.missions.execution.equipment import MissionConfig
from rbxcompose.missions.execution.requests import PauseMission, ResumeMission, RunMission
from rbxcompose.sdk import Ended, Outcome, Refused
from rbxcompose.sdk.component import MissionOver, MissionWaits
from tests.executive.fake_robot import Robot

PATROL = """
interrupts:
  low:
    when: $battery < 50 %
    do: recharge
do:
  - go_to: corner
  - go_to: dock
"""


def ports_of(text: str) -> list[str]:
    return sorted(Mission.ports(Robot(text).mission.config))


def test_it_declares_only_what_its_missions_use() -> None:
    assert ports_of(PATROL) == ["publishes_mission_events", "skill_go_to", "skill_recharge", "value_battery"]
    assert ports_of("do:\n  check: distance($pose, dock) < 1 m") == ["pose", "publishes_mission_events"]
    nearest = "do:\n  for: place\n  in: [dock, corner]\n  order: nearest\n  do:\n    go_to: $place"
    assert ports_of(nearest) == ["pose", "publishes_mission_events", "skill_go_to"]
    assert Mission.ports(MissionConfig()) == {}


def test_a_loop_over_the_nearest_place_waits_for_the_pose() -> None:
    robot = Robot("do:\n  for: place\n  in: [dock, corner]\n  order: nearest\n  do:\n    go_to: $place")
    robot.start()
    robot.advance(0.0)
    assert robot.lines == ["0 mission test waits for pose"]
    robot.look.pose = Pose2(0.9, 0.0, 0.0)
    robot.advance(0.1)
    assert robot.lines[1:] == ["0.1 1.1 Go to the place: go_to corner"]


def test_a_pose_that_no_mission_reads_has_not_arrived() -> None:
    robot = Robot("do: recharge")
    del robot.mission.bound["pose"]
    _, world = robot.mission.world(lambda leaf, result: None, lambda event: None)
    assert world.value("pose") is NOT_ARRIVED


def test_a_mission_that_waits_for_a_value_says_so_again_each_minute() -> None:
    robot = Robot(PATROL)
    robot.start()
    robot.advance(130.0)
    text = "waits for battery, which has not arrived for 60 s"
    assert robot.lines == ["0 mission test waits for battery", f"60 mission test {text}", f"120 mission test {text}"]
    assert robot.events == [MissionWaits("test", text)] * 2
    robot.level(100.0)
    robot.advance(0.0)
    assert robot.lines[-1] == "130 1.1 Go to corner"


def test_it_waits_for_every_value_that_is_read_then_tells_its_story() -> None:
    robot = Robot(PATROL)
    robot.start()
    robot.advance(1.0)
    assert robot.go_to.goals == []
    robot.level(100.0)
    robot.advance(5.2)
    assert robot.go_to.goals[0].request.pose.pose.position.x == 1.0
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(1.3)
    robot.level(49.0)
    robot.advance(2.0)
    assert robot.go_to.goals[1].is_cancelled
    robot.level(100.0)
    robot.recharge.end(Outcome.SUCCEEDED)
    robot.advance(1.0)
    robot.go_to.end(Outcome.ABORTED, "stuck")
    robot.advance(0.0)
    assert robot.lines == [
        "0 mission test waits for battery",
        "1 1.1 Go to corner",
        "6.2 go_to corner: success (5.2 s)",
        "6.2 1.2 Go to dock",
        "7.5 interrupt low: $battery < 50 % (battery 49 %)",
        "7.5 go_to dock: halted (1.3 s)",
        "7.5 2.1 Recharge",
        "9.5 recharge: success (2 s)",
        "9.5 interrupt low done, back to go_to dock",
        "9.5 1.2 Go to dock",
        "10.5 go_to dock: failure (1 s): stuck",
        "10.5 mission test: failure: mission.yaml:8: stuck",
    ]
    assert robot.events == [MissionOver("test", "failure", "mission.yaml:8: stuck")]
    assert robot.mission.summary() == {
        "mission": "test: failure",
        "skills": "go_to 3 (1 success, 1 halted, 1 failure), recharge 1 (1 success)",
    }
    assert robot.statuses == ["waiting for battery", "running test", "test: failure"]


def test_without_a_start_mission_it_does_nothing() -> None:
    robot = Robot("do:\n  go_to: dock", start=None)
    robot.start()
    robot.advance(5.0)
    assert (robot.go_to.goals, robot.lines, robot.mission.summary()) == ([], [], {})
    with pytest.raises(Refused, match="no mission is running"):
        robot.mission.handle(PauseMission())


def test_it_waits_for_a_pose_that_is_read() -> None:
    robot = Robot("do:\n  check: distance($pose, dock) < 1 m")
    robot.start()
    robot.advance(1.0)
    assert robot.events == []
    robot.look.pose = Pose2(0.5, 0.5)
    robot.advance(0.2)
    assert robot.ends[0].outcome == "success"


GO = "do:\n  go_to: dock"


def test_a_goal_whose_server_is_lost_is_sent_again_when_it_is_back_in_time() -> None:
    robot = Robot(GO)
    robot.start()
    robot.go_to.is_available = False
    robot.go_to.end(Outcome.LOST)
    robot.advance(4.0)
    robot.go_to.is_available = True
    robot.advance(0.2)
    assert len(robot.go_to.goals) == 2
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert robot.ends[0].outcome == "success"
    assert robot.lines[1:3] == ["0 the server of go_to is gone; waiting for up to 5 s", "4 go_to: sent again"]


def test_it_fails_when_the_server_stays_away() -> None:
    robot = Robot(GO)
    robot.start()
    robot.go_to.is_available = False
    robot.go_to.end(Outcome.LOST)
    robot.advance(5.2)
    assert robot.ends[0].message == "mission.yaml:2: its server is gone"
    assert 5.0 <= robot.clock.now() < 5.3


def test_a_skill_that_cannot_be_restarted_fails_at_once_when_its_server_is_lost() -> None:
    robot = Robot("do: recharge")
    robot.start()
    robot.recharge.end(Outcome.LOST)
    robot.advance(0.0)
    assert robot.ends[0].outcome == "failure"


def test_a_goal_waits_for_a_server_that_is_not_there_yet() -> None:
    robot = Robot(GO)
    robot.go_to.is_available = False
    robot.start()
    robot.advance(2.0)
    robot.go_to.is_available = True
    robot.advance(0.2)
    assert len(robot.go_to.goals) == 1


@pytest.mark.parametrize("cancelled_first", [True, False])
def test_a_goal_that_a_stop_cancelled_is_no_failure_and_is_sent_again_at_the_resume(cancelled_first: bool) -> None:
    robot = Robot(GO)
    robot.start()
    robot.advance(1.0)
    robot.is_stopped = True
    if cancelled_first:
        robot.go_to.end(Outcome.CANCELED)
        robot.advance(0.2)
    robot.mission.stop()
    if not cancelled_first:
        robot.go_to.end(Outcome.CANCELED)
    robot.advance(3.0)
    with pytest.raises(Refused, match="release it first"):
        robot.mission.handle(ResumeMission())
    robot.is_stopped = False
    robot.mission.release()
    robot.advance(3.0)
    assert len(robot.go_to.goals) == 1
    assert robot.mission.handle(ResumeMission()) == "mission test resumed"
    robot.advance(1.0)
    assert len(robot.go_to.goals) == 2
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert robot.ends[0].outcome == "success"


def test_a_goal_that_someone_else_cancelled_is_a_failure() -> None:
    robot = Robot(GO)
    robot.start()
    robot.go_to.end(Outcome.CANCELED)
    robot.advance(1.0)
    assert robot.ends[0].message == "mission.yaml:2: cancelled by someone else"


def test_a_pause_cancels_the_goal_and_a_resume_sends_it_again() -> None:
    robot = Robot(GO)
    robot.start()
    assert robot.mission.handle(PauseMission()) == "mission test paused"
    assert robot.go_to.goals[0].is_cancelled
    robot.go_to.end(Outcome.CANCELED)
    robot.advance(9.0)
    assert len(robot.go_to.goals) == 1
    with pytest.raises(Refused, match="already paused"):
        robot.mission.handle(PauseMission())
    robot.mission.handle(ResumeMission())
    robot.advance(0.0)
    assert len(robot.go_to.goals) == 2
    with pytest.raises(Refused, match="is not paused"):
        robot.mission.handle(ResumeMission())


def test_a_robot_that_is_stopped_before_the_mission_begins_begins_it_at_the_resume() -> None:
    robot = Robot(GO)
    robot.mission.stop()
    robot.start()
    robot.advance(2.0)
    assert robot.go_to.goals == []
    assert robot.lines == ["0 mission test is held until it is resumed"]
    robot.mission.handle(ResumeMission())
    robot.advance(0.0)
    assert len(robot.go_to.goals) == 1


def test_whoever_runs_a_mission_of_a_stopped_robot_reads_what_it_waits_for() -> None:
    robot = Robot(GO, start=None)
    robot.start()
    robot.is_stopped = True
    answer = robot.mission.handle(RunMission("test"))
    assert answer == "mission test is held: the robot is stopped; 'release' it, then 'mission resume'"


def test_a_late_result_of_a_halted_goal_is_not_heard() -> None:
    robot = Robot("do:\n  - go_to: corner\n    timeout: 1 s\n    optional: true\n  - go_to: dock")
    robot.start()
    robot.advance(1.0)
    robot.go_to.goals[0].then(Ended(Outcome.SUCCEEDED))
    robot.advance(0.5)
    assert len(robot.go_to.goals) == 2
    assert robot.events == []


def test_going_down_halts_the_mission_for_good() -> None:
    robot = Robot(GO)
    robot.start()
    robot.mission.brake()
    assert robot.go_to.goals[0].is_cancelled
    robot.advance(5.0)
    assert robot.lines[-1] == "0 mission test: halted"
    assert robot.mission.summary()["mission"] == "test: halted"
    assert robot.events == []


@dataclass(frozen=True, slots=True)
class Dance(Command):
    about = "toys"


def test_an_unknown_request_is_refused() -> None:
    with pytest.raises(Refused, match=r"does not take the request 'toys\.Dance'"):
        Robot(GO).mission.handle(Dance())


def test_the_summary_of_a_mission_that_calls_no_skill_has_no_skills() -> None:
    robot = Robot("do:\n  log: Hello")
    robot.start()
    robot.advance(1.0)
    assert robot.mission.summary() == {"mission": "test: success"}
