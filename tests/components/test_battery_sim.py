from __future__ import annotations

import pytest

from rbxcompose.msgs.rbxcompose_msgs import SetBatteryLevel
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.sdk import Reply
from rbxcompose.testing import Bench, instance


def bench() -> Bench:
    return Bench(instance("battery", "battery_sim", {"runtime": "10 s"}))


def test_it_tells_its_level_from_0_to_100_once_a_second() -> None:
    robot = bench()
    levels = robot.collect("/battery_level", Float32)
    robot.advance(3.0)
    assert [message.data for message in levels] == pytest.approx([90.0, 80.0, 70.0])


@pytest.mark.parametrize("runtime", [20, 60, 100])
def test_a_level_that_is_a_whole_percentage_is_told_exactly(runtime: int) -> None:
    robot = Bench(instance("battery", "battery_sim", {"runtime": f"{runtime} s"}))
    levels = robot.collect("/battery_level", Float32)
    robot.advance(float(runtime))
    whole = {
        second: 100 * (runtime - second) // runtime for second in range(1, runtime + 1) if 100 * second % runtime == 0
    }
    assert {second: levels[second - 1].data for second in whole} == whole


def test_a_level_that_is_set_is_told_at_once() -> None:
    robot = bench()
    robot.advance(5.5)
    levels = robot.collect("/battery_level", Float32)
    replies: list[Reply[SetBatteryLevel.Response]] = []
    robot.bus.client("bench", "/set_battery_level", SetBatteryLevel)(
        SetBatteryLevel.Request(value=100.0), replies.append
    )
    robot.advance(0.0)
    assert [message.data for message in levels] == [100.0]
    assert [reply.error for reply in replies] == [""]


def test_a_level_out_of_range_is_refused_and_changes_nothing() -> None:
    robot = bench()
    replies: list[Reply[SetBatteryLevel.Response]] = []
    client = robot.bus.client("bench", "/set_battery_level", SetBatteryLevel)
    client(SetBatteryLevel.Request(value=150.0), replies.append)
    robot.advance(0.0)
    assert "between 0 % and 100 %" in replies[0].error
    levels = robot.collect("/battery_level", Float32)
    robot.advance(1.0)
    assert [message.data for message in levels] == pytest.approx([90.0])


def test_a_battery_that_gets_low_is_told_in_the_story() -> None:
    robot = bench()
    robot.advance(9.0)
    assert [text for text in robot.texts() if "battery:" in text] == [
        "battery: Medium battery: 40 %",
        "battery: Low battery: 10 %",
    ]
