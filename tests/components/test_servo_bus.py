"""The component that drives servos: trajectories, single commands, refusals, and what is left at the end."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rbxcompose.actuation.port_errors import LostPortError
from rbxcompose.components.servo_bus import ServoBusConfig
from rbxcompose.msgs.builtin_interfaces import Duration
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint
from rbxcompose.qos import Qos
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.testing import Bench, instance

Follow = FollowJointTrajectory
TICK = 0.00512  # [rad] of an AX-12
JOINT = {"model": "AX-12", "lower": -2.0, "upper": 2.0, "velocity": 1.5, "acceleration": 8.0}
CONFIG: dict[str, Any] = {
    "twin": "servo",
    "joints": {"pan": {**JOINT, "id": 1}, "tilt": {**JOINT, "id": 2, "invert": True}},
    "controllers": {"head": {"joints": ["pan", "tilt"]}},
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

    def _over(self, ended: Ended[Follow.Result]) -> None:
        self.ended = ended

    def ask(self, topic: str, service: Any, request: Any) -> None:
        self.robot.bus.client("me", topic, service)(request, lambda reply: None)
        self.robot.advance(0.1)


@pytest.fixture(params=["servo", "ideal"])
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
