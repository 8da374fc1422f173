"""Muxes that people and programs direct while the robot runs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.requests import Refused, as_data
from rbxcompose.domains.muxes.components.mux import Mux
from rbxcompose.domains.muxes.requests import (
    NONE,
    AddMuxInput,
    DeleteMuxInput,
    LockMuxInputs,
    LookAtMux,
    MuxState,
    ReadMuxChanges,
    SelectMuxInput,
    UnlockMuxInputs,
)
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.std_msgs import Bool, Float64, String
from rbxcompose.msgs.topic_tools_interfaces import MuxAdd, MuxDelete, MuxList, MuxSelect
from rbxcompose.sdk.component import ComponentNoted
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, check_text, instance
from tests.loops import for_all

SLOW, FAST, ZERO = Twist(linear=Vector3(x=0.1)), Twist(linear=Vector3(x=0.4)), Twist()
RANKED = {"teleop": {"priority": 100, "timeout": "0.5 s"}, "navigation": {"priority": 10, "timeout": "0.5 s"}}


def bench(inputs: dict[str, Any] | None = None, **words: Any) -> Bench:
    return Bench(instance("cmd_vel", "mux", {"output": "cmd_vel", "inputs": inputs or RANKED, **words}))


def selecting(**words: Any) -> Bench:
    return bench({"one": {}, "two": {}}, mode="select", **words)


def call(robot: Bench, service: Any, name: str, **fields: Any) -> Any:
    told: list[Any] = []
    client = robot.bus.client("bench", f"/cmd_vel/{name}", service)
    client(service.Request(**fields), told.append)
    robot.advance(0.1)
    return told[0].response


def look(robot: Bench) -> MuxState:
    return robot.host.ask("cmd_vel", LookAtMux("cmd_vel"))


def test_nobody_misses_commands_of_a_source_that_is_silent() -> None:
    robot = bench(message="trajectory_msgs/msg/JointTrajectory")
    inputs = [
        each.reader for each in robot.bus.subscriptions if each.route[0] in ("/cmd_vel/teleop", "/cmd_vel/navigation")
    ]
    assert [reader.expects_speech for reader in inputs] == [False, False]


def test_the_limits_of_a_hand_over_change_while_the_robot_runs() -> None:
    robot = bench(handover={"linear": "0.1 m/s^2"})
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/navigation", SLOW)
    robot.publish("/cmd_vel/teleop", FAST)
    robot.advance(0.1)
    robot.publish("/cmd_vel/teleop", FAST)
    robot.set_live("cmd_vel", **{"handover.linear": "1 m/s^2"})
    robot.advance(0.1)
    robot.publish("/cmd_vel/teleop", FAST)
    assert [item.linear.x for item in out] == pytest.approx([0.1, 0.1, 0.11, 0.21])


def test_the_services_of_topic_tools_select_and_list_by_topic() -> None:
    robot = selecting(profile="topic_tools")
    out = robot.collect("/cmd_vel", Twist)
    assert list(call(robot, MuxList, "list").topics) == ["cmd_vel/one", "cmd_vel/two"]
    answer = call(robot, MuxSelect, "select", topic="/cmd_vel/two")
    assert (answer.success, answer.prev_topic) == (True, "cmd_vel/one")
    robot.publish("/cmd_vel/one", SLOW)
    robot.publish("/cmd_vel/two", FAST)
    assert out == [FAST]
    answer = call(robot, MuxSelect, "select", topic=NONE)
    assert (answer.success, answer.prev_topic) == (True, "cmd_vel/two")
    answer = call(robot, MuxSelect, "select", topic="two")
    assert (answer.success, answer.prev_topic) == (True, "")


def test_what_topic_tools_refuses_fails_and_changes_nothing() -> None:
    robot = selecting(profile="topic_tools")
    assert not call(robot, MuxSelect, "select", topic="three").success
    assert not call(robot, MuxAdd, "add", topic="/cmd_vel/two").success
    assert not call(robot, MuxAdd, "add", topic=NONE).success
    assert not call(robot, MuxDelete, "delete", topic="three").success
    assert not call(robot, MuxDelete, "delete", topic="one").success  # it is selected
    assert (look(robot).selected, [state.name for state in look(robot).inputs]) == ("one", ["one", "two"])


def test_an_input_that_was_added_can_be_selected_and_deleted_again() -> None:
    robot = selecting()
    out = robot.collect("/cmd_vel", Twist)
    assert call(robot, MuxAdd, "add", topic="/joystick/velocity").success
    assert call(robot, MuxSelect, "select", topic="/joystick/velocity").success
    robot.publish("/joystick/velocity", FAST)
    assert call(robot, MuxSelect, "select", topic="one").success
    assert call(robot, MuxDelete, "delete", topic="/joystick/velocity").success
    robot.publish("/joystick/velocity", FAST)
    assert out == [FAST, ZERO]


@pytest.mark.parametrize(("profile", "word", "told"), [
    ("topic_tools", "selected", ["cmd_vel/one", "cmd_vel/two", NONE]),
    ("default", "active", ["one", "two", NONE]),
])  # fmt: skip
def test_who_holds_is_announced_and_latched(profile: str, word: str, told: list[str]) -> None:
    robot = selecting(profile=profile)
    heard = robot.collect(f"/cmd_vel/{word}", String, Qos.LATCHED)
    robot.advance(0.0)
    for name in ("two", NONE):
        robot.host.ask("cmd_vel", SelectMuxInput("cmd_vel", name))
        robot.advance(0.0)
    assert [message.data for message in heard] == told


def test_yocs_announces_idle() -> None:
    robot = bench(profile="yocs")
    heard = robot.collect("/cmd_vel/active", String, Qos.LATCHED)
    robot.publish("/cmd_vel/teleop", FAST)
    robot.advance(1.0)
    assert [message.data for message in heard] == ["idle", "teleop", "idle"]


def test_a_lazy_mux_subscribes_to_the_selected_input_alone() -> None:
    robot = selecting(lazy=True)

    def heard() -> set[str]:
        return {subscription.route[0] for subscription in robot.bus.subscriptions if subscription.owner == "cmd_vel"}

    assert heard() == {"/cmd_vel/one"}
    out = robot.collect("/cmd_vel", Twist)
    call(robot, MuxSelect, "select", topic="two")
    assert heard() == {"/cmd_vel/two"}
    robot.publish("/cmd_vel/two", FAST)
    assert out == [FAST]
    robot.host.ask("cmd_vel", SelectMuxInput("cmd_vel", NONE))
    assert heard() == set()


def test_who_holds_until_when_and_who_waits_for_what_is_told() -> None:
    robot = bench(locks={"pause": {"topic": "pause", "priority": 50}})
    robot.publish("/cmd_vel/navigation", SLOW)
    robot.advance(0.2)
    robot.publish("/cmd_vel/teleop", FAST)
    told = look(robot)
    assert (told.why, told.holder) == ("teleop holds", "teleop")
    assert told.until == pytest.approx(0.7)
    states = {input_state.name: (input_state.state, input_state.why) for input_state in told.inputs}
    assert states == {"teleop": ("holds", ""), "navigation": ("waits", "'teleop' has a higher priority")}
    assert told.inputs[1].silent_for == pytest.approx(0.2)
    robot.publish("/pause", Bool(data=True))
    assert look(robot).inputs[1].why == "pause is on"
    assert [lock.why for lock in look(robot).locks] == ["pause is on"]
    changes = robot.host.ask("cmd_vel", ReadMuxChanges("cmd_vel"))
    assert [change.text for change in changes][:2] == ["navigation holds", "teleop holds"]
    assert robot.host.ask("cmd_vel", ReadMuxChanges("cmd_vel", changes[-1].number)) == ()


def test_a_lock_by_hand_stops_is_told_everywhere_and_outlives_a_restart() -> None:
    robot = bench()
    told = robot.statuses("cmd_vel")
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/navigation", SLOW)
    robot.host.ask("cmd_vel", LockMuxInputs("cmd_vel", ("navigation",)))
    robot.advance(0.0)
    assert out == [SLOW, ZERO]
    assert (told[-1].level, told[-1].message) == (1, "navigation is locked by hand")
    assert robot.events[-1] == ComponentNoted("cmd_vel", "locked by hand: navigation")
    robot.host.failed("cmd_vel", RuntimeError("planted"))
    robot.advance(1.0)
    robot.publish("/cmd_vel/navigation", SLOW)
    assert out[-1] == ZERO
    robot.host.ask("cmd_vel", UnlockMuxInputs("cmd_vel"))
    assert robot.events[-1] == ComponentNoted("cmd_vel", "")
    robot.advance(1.0)
    robot.publish("/cmd_vel/navigation", SLOW)
    assert out[-1] == SLOW


def test_an_input_that_must_come_to_rest_after_a_release_must_do_so_after_a_restart() -> None:
    robot = bench()
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/navigation", SLOW)
    robot.host.stop()
    robot.host.release()
    robot.host.failed("cmd_vel", RuntimeError("planted"))
    for _ in range(20):
        robot.publish("/cmd_vel/navigation", SLOW)
        robot.advance(0.1)
    assert SLOW not in out[1:]
    assert [one.state for one in look(robot).inputs] == ["silent", "must rest"]
    robot.publish("/cmd_vel/navigation", ZERO)
    robot.publish("/cmd_vel/navigation", SLOW)
    assert out[-1] == SLOW
    robot.host.failed("cmd_vel", RuntimeError("planted"))
    robot.advance(2.0)
    robot.publish("/cmd_vel/navigation", SLOW)
    assert out[-1] == SLOW


def test_after_a_restart_nothing_is_let_through_before_orders_have_come_again() -> None:
    robot = bench()
    robot.host.is_restart = True  # as in a process that has started again: its supervisor sends them a little later
    robot.host.prepare(robot.plan.instances)
    robot.host.activate(["cmd_vel"])
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/navigation", SLOW)
    robot.host.ask("cmd_vel", LockMuxInputs("cmd_vel", ("navigation",)))
    robot.advance(0.3)
    robot.publish("/cmd_vel/navigation", SLOW)
    assert SLOW not in out
    robot.publish("/cmd_vel/teleop", FAST)
    assert out[-1] == FAST


def test_a_lock_by_hand_with_a_time_ends_by_itself() -> None:
    robot = bench()
    robot.host.ask("cmd_vel", LockMuxInputs("cmd_vel", (), 2.0))
    assert robot.events[-1] == ComponentNoted("cmd_vel", "locked by hand: teleop until 2.0 s, navigation until 2.0 s")
    robot.advance(2.0)
    assert robot.events[-1] == ComponentNoted("cmd_vel", "")


def test_an_input_with_a_priority_can_be_added_while_the_robot_runs() -> None:
    robot = bench()
    out = robot.collect("/cmd_vel", Twist)
    robot.host.ask("cmd_vel", AddMuxInput("cmd_vel", "bumper", priority=200, timeout=0.5))
    robot.publish("/cmd_vel/teleop", FAST)
    robot.publish("/cmd_vel/bumper", SLOW)
    robot.publish("/cmd_vel/teleop", FAST)
    assert out == [FAST, SLOW]
    robot.host.ask("cmd_vel", DeleteMuxInput("cmd_vel", "bumper"))
    robot.publish("/cmd_vel/teleop", FAST)
    assert out == [FAST, SLOW, FAST]


@for_all("order", [
    SelectMuxInput("cmd_vel", "teleop"),
    AddMuxInput("cmd_vel", "teleop", priority=1, timeout=1.0),
    AddMuxInput("cmd_vel", "bumper"),
    AddMuxInput("cmd_vel", "output", priority=1, timeout=1.0),
    AddMuxInput("cmd_vel", "my-bumper", priority=1, timeout=1.0),
    AddMuxInput("cmd_vel", "", priority=1, timeout=1.0),
    AddMuxInput("cmd_vel", "x" * 61, priority=1, timeout=1.0),
    AddMuxInput("cmd_vel", "bumper", "/front bumper", priority=1, timeout=1.0),
    AddMuxInput("cmd_vel", "bumper", "x" * 250, priority=1, timeout=1.0),
    AddMuxInput("cmd_vel", "bumper", priority=100, timeout=1.0),
    *(AddMuxInput("cmd_vel", "bumper", priority=1, timeout=time) for time in (0.0, -1.0, math.nan, math.inf)),
    DeleteMuxInput("cmd_vel", "bumper"),
    LockMuxInputs("cmd_vel", ("bumper",)),
    *(LockMuxInputs("cmd_vel", ("teleop",), time) for time in (0.0, -5.0, math.nan, 1e308)),
    UnlockMuxInputs("cmd_vel"),
])  # fmt: skip
def test_an_order_without_a_meaning_is_refused_and_changes_nothing(order: Any) -> None:
    robot = bench()
    before = look(robot)
    with pytest.raises(Refused):
        robot.host.ask("cmd_vel", order)
    robot.advance(0.0)
    assert look(robot) == before


def test_no_input_takes_what_the_mux_publishes_itself(tmp_path: Path) -> None:
    text = "bus: {namespace: rover}\nmuxes: {drive: {topic: wheels/cmd_vel, mode: select, inputs: {teleop: {}}}}\n"
    robot = Bench(plan=check_text(f"rbx: 1\nkind: Robot\nname: helper\n{text}", tmp_path).plan)
    for topic in ("wheels/cmd_vel", "/rover/wheels/cmd_vel", "drive/active"):
        with pytest.raises(Refused, match=r"publishes on '/rover/.*' itself"):
            robot.host.ask("drive", AddMuxInput("drive", "echo", topic))
    robot.host.ask("drive", AddMuxInput("drive", "other", "/wheels/cmd_vel"))


def test_what_was_deleted_and_added_in_its_place_outlives_a_restart() -> None:
    robot = bench()
    robot.host.ask("cmd_vel", DeleteMuxInput("cmd_vel", "teleop"))
    robot.host.ask("cmd_vel", AddMuxInput("cmd_vel", "joystick", priority=100, timeout=0.5))
    robot.host.ask("cmd_vel", AddMuxInput("cmd_vel", "teleop", "/far/teleop", priority=50, timeout=0.5))
    before = look(robot).inputs
    robot.host.failed("cmd_vel", RuntimeError("planted"))
    robot.advance(1.0)
    assert look(robot).inputs == before


def test_an_order_that_comes_again_before_the_mux_is_active_waits_for_it() -> None:
    robot = bench()
    robot.host.failed("cmd_vel", RuntimeError("planted"))
    robot.host.recall("cmd_vel", as_data(LockMuxInputs("cmd_vel", ("teleop",))))
    assert not any("by hand" in text for text in robot.texts())
    robot.advance(1.0)
    assert [(one.name, one.why) for one in look(robot).inputs if one.why] == [("teleop", "by hand")]


def test_what_was_selected_first_stays_deleted_after_a_restart() -> None:
    robot = selecting()
    robot.host.ask("cmd_vel", AddMuxInput("cmd_vel", "three"))
    robot.host.ask("cmd_vel", SelectMuxInput("cmd_vel", "three"))
    robot.host.ask("cmd_vel", DeleteMuxInput("cmd_vel", "one"))
    before = look(robot)
    robot.host.failed("cmd_vel", RuntimeError("planted"))
    robot.advance(1.0)
    assert (look(robot).selected, look(robot).inputs) == (before.selected, before.inputs)


def test_an_order_that_fails_after_a_restart_is_not_repeated_again(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = bench()
    robot.host.ask("cmd_vel", AddMuxInput("cmd_vel", "bumper", priority=200, timeout=0.5))
    robot.host.ask("cmd_vel", LockMuxInputs("cmd_vel", ("teleop",)))
    monkeypatch.setattr(Mux, "add_input", lambda *_: 1 / 0)
    robot.host.failed("cmd_vel", RuntimeError("planted"))
    robot.advance(2.0)
    assert [(one.name, one.why) for one in look(robot).inputs] == [("teleop", "by hand"), ("navigation", "")]


def test_another_configuration_keeps_what_was_selected_locked_and_added() -> None:
    robot = selecting()
    robot.host.ask("cmd_vel", AddMuxInput("cmd_vel", "three"))
    robot.host.ask("cmd_vel", SelectMuxInput("cmd_vel", "three"))
    robot.host.ask("cmd_vel", LockMuxInputs("cmd_vel", ("two",)))
    config = {"output": "cmd_vel", "mode": "select", "inputs": {"two": {}, "four": {}}}
    robot.host.prepare([instance("cmd_vel", "mux", config)])
    robot.host.activate(["cmd_vel"])
    robot.advance(0.0)
    told = look(robot)
    assert [(input_state.name, input_state.state) for input_state in told.inputs] == [
        ("two", "locked"),
        ("four", "waits"),
        ("three", "holds"),
    ]


def test_numbers_that_are_none_never_get_through() -> None:
    robot = bench({"one": {}}, mode="select", message="std_msgs/msg/Float64")
    out = robot.collect("/cmd_vel", Float64)
    for number in (math.nan, math.inf, 1.0):
        robot.publish("/cmd_vel/one", Float64(data=number))
    assert [item.data for item in out] == [1.0]


def test_flags_and_positions_are_forwarded_and_never_made_up() -> None:
    robot = bench({"one": {"priority": 1, "timeout": "0.5 s"}}, message="std_msgs/msg/Bool")
    out = robot.collect("/cmd_vel", Bool)
    robot.publish("/cmd_vel/one", Bool(data=True))
    robot.advance(5.0)
    robot.host.stop()
    robot.advance(1.0)
    assert out == [Bool(data=True)]


def test_a_stop_leaves_at_the_deadline_itself() -> None:
    robot = bench()
    times: list[float] = []
    robot.bus.subscribe("test", "/cmd_vel", Twist, Qos.EVENT, lambda message: times.append(robot.clock.now()))
    robot.publish("/cmd_vel/teleop", FAST)
    robot.advance(5.0)
    assert times == [0.0, pytest.approx(0.5, abs=1e-9)]
