"""The component that drives servos: trajectories, single commands, refusals, and what is left at the end."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rbxcompose.domains.devices.serial_ports import LostPortError
from rbxcompose.domains.servos.bus_config import ServoBusConfig
from rbxcompose.msgs.builtin_interfaces import Duration
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.rbxcompose_msgs import MoveJoints
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_duration
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from tests.soak import rare

Follow = FollowJointTrajectory
TICK = 0.00512  # [rad] of an AX-12
LIMITS = {"lower": -2.0, "upper": 2.0, "velocity": 1.5, "acceleration": 8.0}
CONFIG: dict[str, Any] = {
    "twin": "servo",
    "rate": 50.0,
    "joints": {
        "pan": {**LIMITS, "servos": [{"id": 1, "model": "AX-12"}]},
        "tilt": {**LIMITS, "servos": [{"id": 2, "model": "AX-12", "invert": True}]},
    },
    "controllers": {
        "head": {"type": "joint_trajectory", "settings": {"type": "joint_trajectory", "joints": ["pan", "tilt"]}}
    },
}


class Head:
    """Two joints, where they are, and how the last goal ended."""

    def __init__(self, **config: Any) -> None:
        self.robot = Bench(instance("servos", "servo_bus", CONFIG | config), start=False)
        self.at: dict[str, float] = {}
        self.ended: Ended[Follow.Result] | None = None
        bus = self.robot.bus
        bus.subscribe("me", "/joint_states", JointState, Qos.STATE, self._moved)
        self.goals = bus.action_client("me", "/head/follow_joint_trajectory", Follow)
        self.moves = bus.action_client("me", "/head/move", MoveJoints)
        self.moved: Ended[MoveJoints.Result] | None = None
        self.commands = {
            name: bus.publisher("me", f"/{name}/command", Float64, Qos.COMMAND) for name in ("pan", "tilt")
        }
        self.robot.advance(0.2)

    def _moved(self, message: JointState) -> None:
        self.at = dict(zip(message.name, map(float, message.position), strict=True))

    def follow(self, *points: tuple[float, float, float], joints: tuple[str, ...] = ("pan", "tilt")) -> Any:
        """Send a goal: the positions of both joints and a time, for each point."""
        self.ended = None
        made = [
            JointTrajectoryPoint(
                positions=np.array(at), time_from_start=Duration(sec=int(time), nanosec=round(time % 1 * 1e9))
            )
            for *at, time in points
        ]
        goal = Follow.Goal(trajectory=JointTrajectory(joint_names=joints, points=tuple(made)))
        return self.goals(goal, self._over)

    def move(self, duration: float = 0.0, **positions: float) -> Any:
        """Move joints by name."""
        self.moved = None
        goal = MoveJoints.Goal(
            joints=tuple(positions), positions=np.array([*positions.values()]), duration=to_duration(duration)
        )
        return self.moves(goal, self._arrived)

    def _arrived(self, ended: Ended[MoveJoints.Result]) -> None:
        self.moved = ended

    @property
    def move_ended(self) -> tuple[str, str]:
        """How the last move ended, and why."""
        assert self.moved
        assert self.moved.result
        return self.moved.outcome, self.moved.result.message

    @property
    def follow_ended(self) -> tuple[str, str]:
        """How the last trajectory ended, and why."""
        assert self.ended
        assert self.ended.result
        return self.ended.outcome, self.ended.result.error_string

    def _over(self, ended: Ended[Follow.Result]) -> None:
        self.ended = ended

    def ask(self, topic: str, service: Any, request: Any) -> None:
        self.robot.bus.client("me", topic, service)(request, lambda reply: None)
        self.robot.advance(0.1)


@pytest.fixture(params=["servo", *rare("ideal")])
def head(request: pytest.FixtureRequest) -> Head:
    return Head(twin=request.param)


def test_a_trajectory_ends_within_a_tick(head: Head) -> None:
    head.follow((0.4, -0.2, 1.0), (-0.5, 0.3, 2.5))
    head.robot.advance(4.0)
    assert head.ended
    assert head.ended.outcome is Outcome.SUCCEEDED
    assert head.at["pan"] == pytest.approx(-0.5, abs=TICK)
    assert head.at["tilt"] == pytest.approx(0.3, abs=TICK)


def test_goals_that_make_no_sense_are_refused_with_the_reason(head: Head) -> None:
    for points, joints, reason in (
        (((5.0, 0.0, 2.0),), ("pan", "tilt"), "pan"),
        (((0.1, 0.1, 2.0), (0.2, 0.2, 1.0)), ("pan", "tilt"), "before the point"),
        (((float("nan"), 0.0, 1.0),), ("pan", "tilt"), "nan"),
        (((0.1, 0.1, 1.0),), ("pan", "roll"), "roll"),
    ):
        head.follow(*points, joints=joints)
        head.robot.advance(0.2)
        assert head.ended
        assert head.ended.outcome is Outcome.ABORTED
        assert head.ended.result
        assert head.ended.result.error_code < 0
        assert reason in head.ended.result.error_string
    assert head.at == pytest.approx({"pan": 0.0, "tilt": 0.0}, abs=TICK)


def test_a_joint_moves_by_its_name_in_its_time_while_the_others_stay(head: Head) -> None:
    head.move(2.0, pan=0.5)
    head.robot.advance(1.0)
    assert head.moved is None
    assert head.at["pan"] == pytest.approx(0.25, abs=0.05)
    head.robot.advance(2.0)
    assert head.move_ended == ("succeeded", "arrived")
    assert head.at == pytest.approx({"pan": 0.5, "tilt": 0.0}, abs=TICK)


def test_without_a_duration_a_move_is_as_fast_as_the_limits_allow(head: Head) -> None:
    head.move(pan=1.5, tilt=-0.1)
    head.robot.advance(0.9)
    assert head.moved is None  # 1.5 rad/s
    head.robot.advance(1.1)
    assert head.move_ended == ("succeeded", "arrived")
    assert head.at == pytest.approx({"pan": 1.5, "tilt": -0.1}, abs=TICK)


def test_a_move_that_makes_no_sense_is_refused_with_the_reason_and_the_joints_rest(head: Head) -> None:
    for duration, positions, reason in (
        (2.0, {"pan": 5.0}, "outside of its limits"),
        (0.1, {"pan": 1.0}, "its limit is 1.5"),
        (2.0, {"roll": 1.0}, "joint 'roll' is unknown"),
        (2.0, {}, "no joints"),
        (-1.0, {"pan": 1.0}, "before the start"),
        (2.0, {"pan": float("nan")}, "nan"),
    ):
        head.move(2.0, tilt=0.5)
        head.robot.advance(0.5)
        head.move(duration, **positions)
        head.robot.advance(0.5)
        outcome, message = head.move_ended
        assert outcome == "aborted"
        assert reason in message
        there = dict(head.at)
        head.robot.advance(0.5)
        assert head.at == there


def test_a_joint_without_limits_needs_a_duration() -> None:
    free = Head(joints=CONFIG["joints"] | {"pan": {"servos": [{"id": 1, "model": "AX-12"}]}})
    free.move(pan=0.5)
    free.robot.advance(0.5)
    assert "joint 'pan' has no limits that say how fast" in free.move_ended[1]
    free.move(1.0, pan=0.5)
    free.robot.advance(2.0)
    assert free.move_ended[0] == "succeeded"


def test_a_newer_goal_of_either_action_replaces_the_older_one(head: Head) -> None:
    head.move(3.0, pan=1.0)
    head.robot.advance(1.0)
    head.follow((-0.5, 0.0, 3.0))
    head.robot.advance(0.1)
    assert head.move_ended == ("aborted", "replaced by a newer goal of 'follow_joint_trajectory'")
    head.robot.advance(1.0)
    assert head.ended is None
    head.move(2.0, pan=0.3)
    head.robot.advance(0.1)
    assert head.follow_ended == ("aborted", "replaced by a newer goal of 'move'")
    head.robot.advance(3.0)
    assert head.move_ended[0] == "succeeded"
    assert head.at["pan"] == pytest.approx(0.3, abs=TICK)


def test_a_newer_goal_of_the_same_action_replaces_the_older_one_with_the_reason(head: Head) -> None:
    older: list[Ended[MoveJoints.Result]] = []
    head.moves(MoveJoints.Goal(joints=("pan",), positions=np.array([1.0]), duration=Duration(sec=3)), older.append)
    head.robot.advance(1.0)
    head.move(1.0, pan=0.0)
    head.robot.advance(2.0)
    assert [item.result and item.result.message for item in older] == ["replaced by a newer goal of 'move'"]
    assert head.move_ended[0] == "succeeded"


def test_of_goals_that_come_at_the_same_time_the_last_one_leads(head: Head) -> None:
    head.follow((1.0, 0.0, 2.0))
    head.move(1.0, pan=-0.3)
    head.robot.advance(3.0)
    assert head.follow_ended[0] == "aborted"
    assert head.move_ended[0] == "succeeded"
    head.move(1.0, pan=0.5)
    head.follow((0.2, 0.0, 2.0))
    head.robot.advance(3.0)
    assert head.move_ended[0] == "aborted"
    assert head.follow_ended[0] == "succeeded"
    assert head.at["pan"] == pytest.approx(0.2, abs=TICK)


def test_a_goal_that_is_replaced_while_it_is_being_canceled_is_canceled(head: Head) -> None:
    sent = head.move(3.0, pan=1.5)
    head.robot.advance(1.0)
    sent.cancel()
    head.follow((0.0, 0.0, 2.0))
    head.robot.advance(3.0)
    assert head.move_ended == ("canceled", "canceled")
    assert head.follow_ended[0] == "succeeded"


def test_a_move_is_canceled_and_refused_like_a_trajectory(head: Head) -> None:
    sent = head.move(3.0, pan=1.5)
    head.robot.advance(1.0)
    sent.cancel()
    head.robot.advance(1.0)
    assert head.move_ended[0] == "canceled"
    there = dict(head.at)
    head.robot.host.stop()
    head.move(1.0, pan=0.0)
    head.robot.advance(1.0)
    assert head.moved
    assert head.moved.outcome is Outcome.REJECTED
    assert head.at == there


def test_a_single_joint_is_commanded_within_its_limits_but_not_while_a_controller_leads_it(head: Head) -> None:
    head.commands["pan"](Float64(data=9.0))
    head.robot.advance(4.0)
    assert head.at["pan"] == pytest.approx(2.0, abs=TICK)
    head.follow((1.0, 0.0, 2.0))
    head.robot.advance(1.0)
    head.commands["pan"](Float64(data=-2.0))
    head.robot.advance(3.0)
    assert head.at["pan"] == pytest.approx(1.0, abs=TICK)


def test_a_disabled_joint_ends_the_trajectory_of_its_group_and_ignores_commands(head: Head) -> None:
    head.follow((1.0, 1.0, 3.0))
    head.robot.advance(1.0)
    head.ask("/pan/enable", SetBool, SetBool.Request(data=False))
    head.robot.advance(1.0)
    assert head.ended
    assert head.ended.outcome is Outcome.ABORTED
    assert head.ended.result
    assert "pan" in head.ended.result.error_string
    there = head.at["pan"]
    head.commands["pan"](Float64(data=-1.0))
    head.robot.advance(1.0)
    assert head.at["pan"] == there
    head.ask("/pan/enable", SetBool, SetBool.Request(data=True))
    head.commands["pan"](Float64(data=-1.0))
    head.robot.advance(3.0)
    assert head.at["pan"] == pytest.approx(-1.0, abs=TICK)


def test_a_relaxed_joint_moves_again_at_the_next_command(head: Head) -> None:
    head.commands["tilt"](Float64(data=0.5))
    head.robot.advance(2.0)
    head.ask("/tilt/relax", Trigger, Trigger.Request())
    head.commands["tilt"](Float64(data=-0.5))
    head.robot.advance(2.0)
    assert head.at["tilt"] == pytest.approx(-0.5, abs=TICK)


def test_a_stop_ends_the_trajectory_and_refuses_others_until_the_release(head: Head) -> None:
    head.follow((1.5, 0.0, 3.0))
    head.robot.advance(1.0)
    head.robot.host.stop()
    head.robot.advance(1.0)
    there = dict(head.at)
    assert head.ended
    assert head.ended.outcome is not Outcome.SUCCEEDED
    head.follow((0.0, 0.0, 1.0))
    head.robot.advance(2.0)
    assert head.at == there
    head.robot.host.release()
    head.follow((0.0, 0.0, 2.0))
    head.robot.advance(3.0)
    assert head.at["pan"] == pytest.approx(0.0, abs=TICK)


def test_a_canceled_trajectory_comes_to_rest(head: Head) -> None:
    sent = head.follow((1.5, 0.0, 3.0))
    head.robot.advance(1.0)
    sent.cancel()
    head.robot.advance(1.0)
    assert head.ended
    assert head.ended.outcome is Outcome.CANCELED
    there = dict(head.at)
    assert 0.1 < there["pan"] < 1.4
    head.robot.advance(1.0)
    assert head.at == there


def test_noise_is_in_what_is_measured_and_its_seed_repeats_it() -> None:
    told = []
    for seed in (1, 1, 2):
        head, seen = Head(noise=2 * TICK, seed=seed), []
        for _ in range(50):
            head.robot.advance(0.02)
            seen.append(head.at["pan"])
        told.append(seen)
    assert told[0] == told[1]
    assert told[0] != told[2]
    assert 0 < max(map(abs, told[0])) < 10 * TICK


class Gone:
    """A bus whose port is not there."""

    def read(self, *_: Any, **__: Any) -> Any:
        raise LostPortError("/dev/servos", "was unplugged")

    reopen = write = read


def test_joints_on_a_path_are_relaxed_after_a_port_was_gone(head: Head) -> None:
    head.follow((0.0, 0.0, 0.1), (1.0, 0.5, 2.0))
    head.robot.advance(1.0)
    driver: Any = head.robot.component("servos")
    bus, driver.cycle.bus = driver.cycle.bus, Gone()
    head.robot.advance(1.0)
    driver.cycle.bus = bus
    head.robot.advance(1.0)
    assert [bus.line[id_].get("torque_enable") for id_ in (1, 2)] == [0, 0]


@pytest.mark.parametrize(("first", "torque", "at"), [("", 0, -1.0), ("stop", 1, 0.5), ("retire", 1, 0.5)])
def test_joints_hold_that_are_not_parked_since_the_robot_is_stopped_or_its_driver_starts_again(
    first: str, torque: int, at: float
) -> None:
    head = Head(on_shutdown="park", park={"pan": -1.0})
    head.commands["pan"](Float64(data=0.5))
    head.robot.advance(2.0)
    driver: Any = head.robot.component("servos")
    servo = driver.cycle.bus.line[1]
    if first == "retire":
        head.robot.host.retire(["servos"])
    else:
        if first:
            head.robot.host.stop()
        head.robot.host.brake()
        head.robot.advance(4.0)
        assert driver.is_at_rest
        head.robot.host.shutdown()
    assert servo.get("torque_enable") == torque
    assert (servo.get("present_position") - 512) * TICK == pytest.approx(at, abs=0.05)


def test_after_a_port_was_gone_joints_are_relaxed_and_move_from_where_they_are(head: Head) -> None:
    head.commands["pan"](Float64(data=1.0))
    head.robot.advance(2.0)
    driver: Any = head.robot.component("servos")
    bus, driver.cycle.bus = driver.cycle.bus, Gone()
    head.robot.advance(0.1)
    for _ in range(20):
        head.commands["pan"](Float64(data=-1.0))
        head.robot.advance(0.05)
    servo = bus.line[1]
    servo.set("torque_enable", 0)
    servo.move_to(400)  # by hand
    driver.cycle.bus = bus
    head.robot.advance(1.0)
    assert servo.get("torque_enable") == 0  # what was commanded meanwhile is not done now
    assert servo.get("present_position") == 400
    head.commands["pan"](Float64(data=0.0))
    head.robot.advance(0.03)
    assert abs(servo.get("goal_position") - 400) < 5
    head.robot.advance(2.0)
    assert head.at["pan"] == pytest.approx(0.0, abs=TICK)


def test_the_configuration_has_no_port_by_default() -> None:
    assert ServoBusConfig().port == ""
