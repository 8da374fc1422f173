"""What a mission asks of the robot: topics, services, skills of all kinds; what goes wrong is a failure of the leaf."""

from __future__ import annotations

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.missions.execution.requests import CancelMission, PauseMission, ResumeMission
from rbxcompose.msgs.geometry_msgs import PoseStamped
from rbxcompose.msgs.rbxcompose_msgs import Recharge
from rbxcompose.msgs.std_msgs import Bool, Float32, String
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.sdk import Outcome
from tests.executive.fake_robot import Robot, ToySlow


def started(text: str) -> Robot:
    robot = Robot(text)
    robot.start()
    return robot


def end_of(robot: Robot) -> str:
    end = robot.ends[-1]
    return end.message if end.outcome == "failure" else end.outcome


def test_a_message_is_published_with_its_fields() -> None:
    robot = started("do:\n  publish: words\n  message: at $x\ndata:\n  x: kitchen")
    assert robot.sent == [String(data="at kitchen")]
    assert end_of(robot) == "success"


def test_a_place_becomes_a_pose_in_a_message() -> None:
    robot = started("do:\n  publish: goal\n  message:\n    header:\n      frame_id: map")
    assert isinstance(robot.sent[0], PoseStamped)
    assert robot.sent[0].header.frame_id == "map"


@pytest.mark.parametrize(
    ("is_success", "end"), [(True, "success"), (False, "mission.yaml:2: not now")], ids=["success", "failure"]
)
def test_the_answer_of_a_service_tells_whether_the_call_succeeded(is_success: bool, end: str) -> None:
    robot = started("do:\n  call: reset")
    robot.reset.answer(Trigger.Response(success=is_success, message="" if is_success else "not now"))
    robot.advance(0.0)
    assert end_of(robot) == end


def test_what_a_service_answers_can_be_kept() -> None:
    robot = started("do:\n  - call: reset\n    save: answer\n  - log: it said $answer.message")
    robot.reset.answer(Trigger.Response(success=True, message="done"))
    robot.advance(0.0)
    assert "0 it said done" in robot.lines


def test_a_call_that_nobody_answers_fails_with_the_reason() -> None:
    robot = started("do:\n  call: reset")
    robot.reset.answer(None, "no answer within 5 s")
    robot.advance(0.0)
    assert end_of(robot) == "mission.yaml:2: no answer within 5 s"


def test_a_server_that_never_comes_is_a_failure_after_five_seconds() -> None:
    robot = Robot("do:\n  call: reset")
    robot.reset.is_available = False
    robot.start()
    robot.advance(4.8)
    assert not robot.events
    robot.advance(0.5)
    assert end_of(robot) == "mission.yaml:2: nothing serves reset"


@pytest.mark.parametrize("speed", ["0 %", "130 %", "-10 %"])
def test_a_computed_number_beyond_its_range_is_a_failure_and_no_goal_is_sent(speed: str) -> None:
    robot = started(f"do:\n  reach:\n    pose: home\n    speed: $share * 1\ndata:\n  share: {speed}")
    assert robot.reach.goals == []
    assert end_of(robot).endswith(f"the speed must be above 0 % and at most 100 %, not {speed}")


def test_a_service_can_be_a_skill() -> None:
    robot = started("do:\n  switch: true")
    assert robot.switch.asked[0][0] == SetBool.Request(data=True)
    robot.switch.answer(SetBool.Response(success=True))
    robot.advance(0.0)
    assert end_of(robot) == "success"


def test_a_message_of_another_shape_is_told_once_and_gives_no_value() -> None:
    robot = started("do:\n  wait_for: $battery < 50 %")
    robot.mission.received("value_battery", String(data="full"))
    robot.mission.received("value_battery", Trigger.Response())
    robot.mission.received("value_battery", Trigger.Response())
    assert [line for line in robot.lines if "no field" in line] == [
        "0 value battery: the messages on battery_level have no field 'data'"
    ]


def test_a_skill_that_can_pause_is_held_and_goes_on() -> None:
    robot = started("do: scan")
    robot.mission.handle(PauseMission())
    assert robot.pauses.asked[-1][0] == SetBool.Request(data=True)
    robot.pauses.answer(SetBool.Response(success=True))
    assert not robot.scan.goals[0].is_cancelled
    robot.mission.handle(ResumeMission())
    robot.advance(0.0)
    assert robot.pauses.asked[-1][0] == SetBool.Request(data=False)
    robot.pauses.answer(SetBool.Response(success=True))
    robot.scan.end(Outcome.SUCCEEDED)
    robot.advance(0.0)
    assert (len(robot.scan.goals), end_of(robot)) == (1, "success")


def test_one_that_cannot_be_held_after_all_is_cancelled_and_sent_again() -> None:
    robot = started("do: scan")
    robot.mission.handle(PauseMission())
    robot.pauses.answer(None, "gone")
    assert robot.scan.goals[0].is_cancelled
    robot.mission.handle(ResumeMission())
    robot.advance(0.0)
    assert len(robot.scan.goals) == 2


def test_a_held_goal_that_a_stop_ends_is_sent_again() -> None:
    robot = started("do: scan")
    robot.mission.stop()
    robot.scan.end(Outcome.CANCELED)
    robot.advance(3.0)
    assert not robot.events
    robot.mission.handle(ResumeMission())
    robot.advance(0.0)
    assert len(robot.scan.goals) == 2


def test_a_call_goes_on_while_the_robot_is_stopped_and_its_answer_waits_for_the_resume() -> None:
    robot = started("do:\n  - call: reset\n  - go_to: corner")
    robot.mission.stop()
    robot.reset.answer(Trigger.Response(success=True))
    robot.advance(3.0)
    assert not robot.go_to.goals
    robot.mission.handle(ResumeMission())
    robot.advance(0.0)
    assert (len(robot.reset.asked), len(robot.go_to.goals)) == (1, 1)


def test_a_mission_begins_without_events_and_ends_its_wait_with_one_that_comes_meanwhile() -> None:
    robot = started("do:\n  - wait_for: $confirmed\n  - wait: 31 s\n  - wait_for: $confirmed")
    for _ in range(2):  # the second one comes between the waits
        robot.advance(20.0)
        robot.mission.received("value_confirmed", Bool(data=True))
    robot.advance(60.0)
    assert not robot.events
    robot.mission.received("value_confirmed", Bool(data=True))
    robot.advance(0.0)
    assert end_of(robot) == "success"


def test_the_reason_in_a_result_is_told() -> None:
    robot = started("do: recharge")
    robot.recharge.end(Outcome.ABORTED, result=Recharge.Result(message="away from the dock"))
    robot.advance(0.0)
    assert end_of(robot) == "mission.yaml:1: away from the dock"


# Python


def test_a_function_is_a_skill_with_arguments_and_results() -> None:
    robot = started("do:\n  - toy_count: corner\n    save: found\n  - log: $found.people people")
    assert "0 1 people" in robot.lines
    assert end_of(robot) == "success"


def test_a_function_may_end_with_an_outcome_of_its_own() -> None:
    robot = started("do:\n  toy_count:\n    room: dock\n    least: 3")
    assert end_of(robot) == "mission.yaml:2: nobody"


@pytest.mark.parametrize(("name", "told"), [("raise", "ZeroDivisionError: no such thing"), ("exit", "SystemExit: 7")])
def test_what_python_raises_is_a_failure_that_is_told(name: str, told: str) -> None:
    robot = started(f"do:\n  fallback:\n    - toy_{name}\n    - log: went on")
    assert f"0 mission.yaml:3: {told}" in robot.lines
    assert end_of(robot) == "success"


@pytest.mark.parametrize(("fails", "end"), [("false", "success"), ("true", "mission.yaml:2: toy_slow failed")])
def test_an_activity_takes_its_time(fails: str, end: str) -> None:
    robot = started(f"do:\n  toy_slow: {fails}")
    robot.advance(0.85)
    assert not robot.events
    robot.advance(0.1)
    assert end_of(robot) == end


def test_an_activity_is_held_and_halted() -> None:
    ToySlow.heard.clear()
    robot = started("do:\n  toy_slow\n")
    robot.advance(0.45)
    robot.mission.handle(PauseMission())
    robot.advance(5.0)
    robot.mission.handle(ResumeMission())
    robot.advance(0.3)
    assert not robot.events
    robot.mission.handle(CancelMission())
    assert ToySlow.heard == ["pause", "resume", "halt"]


@pytest.mark.parametrize("call", ["start", "step"])
def test_a_skill_that_keeps_everything_waiting_is_told_once(call: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot("do:\n  toy_slow\n")
    does = getattr(ToySlow, call)

    def slow(*words: object, **more: object) -> object:
        robot.stepped.advance_to(robot.clock.now() + 0.012)
        return does(*words, **more)

    monkeypatch.setattr(ToySlow, call, slow)
    robot.start()
    robot.advance(2.0)
    warned = [line for line, level in zip(robot.lines, robot.levels, strict=True) if level is Level.WARN]
    assert len(warned) == 1
    assert "the skill toy_slow took 12 ms in one call and held up all missions" in warned[0]
    assert end_of(robot) == "success"


def test_a_skill_in_python_that_is_quick_is_not_told_of() -> None:
    robot = started("do:\n  - toy_slow\n  - toy_count: corner")
    robot.advance(2.0)
    assert set(robot.levels) == {Level.OK}


def test_speech_takes_as_long_as_its_words() -> None:
    robot = started("do:\n  say: one two three")
    robot.advance(2.0)
    assert "1.2 say one two three: success (1.2 s)" in robot.lines


def test_values_of_the_battery_arrive_in_si() -> None:
    robot = started("do:\n  wait_for: $battery < 50 %")
    robot.mission.received("value_battery", Float32(data=49.0))
    robot.advance(0.0)
    assert end_of(robot) == "success"
