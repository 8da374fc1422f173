from __future__ import annotations

import pytest

from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.std_msgs import Empty
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

SLOW, FAST, ZERO = Twist(linear=Vector3(x=0.1)), Twist(linear=Vector3(x=0.4)), Twist()


def bench() -> Bench:
    inputs = {"teleop": {"priority": 100, "timeout": "0.5 s"}, "navigation": {"priority": 10, "timeout": "0.5 s"}}
    return Bench(instance("cmd_vel", "mux", {"output": "cmd_vel", "inputs": inputs}))


def test_the_higher_priority_wins_while_it_talks() -> None:
    robot = bench()
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/navigation", SLOW)
    robot.publish("/cmd_vel/teleop", FAST)
    robot.publish("/cmd_vel/navigation", SLOW)
    robot.advance(0.6)
    robot.publish("/cmd_vel/navigation", SLOW)
    assert out == [SLOW, FAST, ZERO, SLOW]


def test_one_zero_follows_the_last_command_and_then_silence() -> None:
    robot = bench()
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/navigation", SLOW)
    robot.advance(5.0)
    assert out == [SLOW, ZERO]


def test_it_wakes_when_sources_may_have_fallen_silent_and_not_for_each_message(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = bench()
    component = robot.component("cmd_vel")
    wake, woken = component.wake, []

    def counted() -> None:
        woken.append(robot.clock.now())
        wake()

    monkeypatch.setattr(component, "wake", counted)
    times: list[float] = []
    robot.bus.subscribe("test", "/cmd_vel", Twist, Qos.EVENT, lambda message: times.append(robot.clock.now()))
    for _ in range(50):
        robot.publish("/cmd_vel/navigation", SLOW)
        robot.advance(0.1)
    robot.advance(5.0)
    assert times[-1] == pytest.approx(4.9 + 0.5, abs=1e-9)  # the zero
    assert len(times) == 51
    assert len(woken) <= 12


def test_a_stop_sends_zero_at_once_and_lets_nothing_through_until_rest_after_release() -> None:
    robot = bench()
    robot.publish("/cmd_vel/navigation", SLOW)
    out = robot.collect("/cmd_vel", Twist)
    robot.host.stop()
    robot.publish("/cmd_vel/navigation", SLOW)
    robot.host.release()
    robot.publish("/cmd_vel/navigation", SLOW)
    assert out == [ZERO]
    robot.publish("/cmd_vel/navigation", ZERO)
    robot.publish("/cmd_vel/navigation", SLOW)
    assert out == [ZERO, ZERO, SLOW]


def test_a_mux_that_is_restarted_during_a_stop_comes_back_closed() -> None:
    robot = bench()
    robot.host.stop()
    robot.host.failed("cmd_vel", RuntimeError("planted"))
    robot.advance(1.0)
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/teleop", FAST)
    assert (out or [ZERO])[-1] == ZERO
    assert FAST not in out


def test_nothing_follows_the_last_zero_when_the_robot_goes_down() -> None:
    robot = bench()
    out = robot.collect("/cmd_vel", Twist)
    robot.host.brake()
    robot.publish("/cmd_vel/teleop", FAST)
    robot.advance(1.0)
    assert out == [ZERO]


def locked_bench() -> tuple[Bench, list[DiagnosticStatus]]:
    inputs = {"teleop": {"priority": 100, "timeout": "0.5 s"}, "navigation": {"priority": 10, "timeout": "0.5 s"}}
    locks = {"deadman": {"priority": 50, "timeout": "0.3 s"}}
    robot = Bench(instance("cmd_vel", "mux", {"output": "cmd_vel", "inputs": inputs, "locks": locks}))
    return robot, robot.statuses("cmd_vel")


def test_a_lock_without_a_heartbeat_is_a_warning_that_names_what_is_locked_out() -> None:
    robot, told = locked_bench()
    robot.advance(0.5)
    assert (told[-1].level, told[-1].message) == (1, "deadman gives no heartbeat: navigation is locked out")
    robot.publish("/cmd_vel/deadman", Empty())
    assert (told[-1].level, told[-1].message) == (0, "no input")
    robot.advance(0.5)
    assert told[-1].level == 1


def test_a_lock_without_a_heartbeat_is_still_a_warning_when_the_robot_goes_down() -> None:
    robot, told = locked_bench()
    robot.advance(0.5)
    robot.host.brake()
    robot.publish("/cmd_vel/navigation", SLOW)
    robot.advance(0.0)
    assert (told[-1].level, robot.texts()) == (1, [])


def test_commands_that_are_locked_out_are_told_in_the_log_once_each_time() -> None:
    robot, _ = locked_bench()
    for _ in range(2):
        for _ in range(10):
            robot.publish("/cmd_vel/navigation", SLOW)
            robot.advance(0.1)
        robot.advance(1.0)
    line = "cmd_vel: commands are blocked: deadman gives no heartbeat: navigation is locked out"
    assert robot.texts() == [line] * 2


def test_an_open_lock_and_commands_above_it_are_told_nowhere() -> None:
    robot, _ = locked_bench()
    robot.publish("/cmd_vel/teleop", FAST)
    robot.publish("/cmd_vel/deadman", Empty())
    robot.publish("/cmd_vel/navigation", SLOW)
    assert robot.texts() == []


def test_its_status_has_no_time_that_the_next_message_or_none_would_make_wrong() -> None:
    robot = bench()
    told = robot.statuses("cmd_vel")
    for _ in range(30):
        robot.publish("/cmd_vel/navigation", SLOW)
        robot.advance(0.1)
    robot.advance(3.0)
    assert told[-1].message == "no input"
    assert "navigation holds" in {status.message for status in told}
    assert not any(letter.isdigit() for status in told for letter in status.message)


def test_its_status_tells_when_a_source_need_no_longer_come_to_rest() -> None:
    robot = bench()
    told = robot.statuses("cmd_vel")
    robot.publish("/cmd_vel/teleop", FAST)
    robot.host.stop()
    robot.host.release()
    for _ in range(12):
        robot.publish("/cmd_vel/teleop", FAST)
        robot.advance(0.1)
    assert told[-1].message == "teleop must come to rest once"
    robot.advance(3.0)
    assert told[-1].message == "no input"
