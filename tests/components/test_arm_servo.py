"""Commands by hand for the tip of an arm: what is none is refused with the reason, and moves nothing."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from rbxcompose.domains.arms.teleoperation import STATUS, STREAM, TIMEOUT, ArmServo, servo_ports
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped, Quaternion, Twist, TwistStamped, Vector3
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.ports import Out, Qos
from tests.motion.test_arm_task import KINEMATICS, PLANNER

AT = {"turn": 0.8, "lift": 0.0, "bend": 0.5}
NOW = 10_000_000_000  # [ns]
HERE = KINEMATICS.tip_pose(PLANNER.space.clamped(PLANNER.space.lower) * 0 + list(AT.values())).translation


def servo() -> tuple[ArmServo, list[Any], list[str]]:
    """Return one, with what it sends and tells."""
    sent: list[Any] = []
    told: list[str] = []
    works: Any = SimpleNamespace(kinematics=KINEMATICS, planner=PLANNER, space=PLANNER.space)
    return ArmServo(works, {STREAM: sent.append, STATUS: lambda message: told.append(message.data)}), sent, told


def twist(y: float = 0.1, frame: str = "", stamp: int = 0) -> TwistStamped:
    return TwistStamped(header=Header(frame_id=frame, stamp=to_time(stamp)), twist=Twist(linear=Vector3(y=y)))


def pose(x: float, w: float = 1.0) -> PoseStamped:
    return PoseStamped(pose=Pose(position=Point(x=x, y=HERE[1], z=HERE[2]), orientation=Quaternion(w=w)))


@pytest.mark.parametrize(
    ("message", "told"),
    [
        (twist(math.nan), "not finite"),
        (twist(math.inf), "not finite"),
        (pose(math.nan), "not finite"),
        (pose(0.3, w=0.0), "no rotation"),
        (twist(frame="nowhere"), "there is no link 'nowhere'"),
        (twist(stamp=NOW - 300_000_000), "a command is 0.30 s old"),
    ],
)
def test_a_command_that_is_none_is_refused_and_moves_nothing(message: TwistStamped | PoseStamped, told: str) -> None:
    arm_servo, sent, _ = servo()
    assert told in arm_servo.take(message, 0.0, NOW)
    assert not arm_servo.is_wanted
    assert not arm_servo.go_on(0.0, NOW, AT)
    assert sent == []


def test_the_status_is_there_for_who_listens_later() -> None:
    config: Any = SimpleNamespace(name="arm", stream="arm/joint_trajectory")
    status = servo_ports(config)[STATUS]
    assert isinstance(status, Out)
    assert status.qos is Qos.LATCHED  # it is published at the start, and when it changes


def test_each_message_to_the_controller_ends_at_rest_and_the_last_command_counts_for_a_while() -> None:
    arm_servo, sent, told = servo()
    assert arm_servo.take(twist(0.02, frame="ground"), 0.0, NOW) == ""
    steps = [arm_servo.go_on(step * 0.02, NOW + step * 20_000_000, AT) for step in range(60)]
    assert not any(message.points[-1].velocities.any() for message in sent)
    assert told[0] != "idle"
    assert told[-1] == "idle"
    assert not steps[-1]
    assert steps.index(False) * 0.02 < TIMEOUT + 0.2


def test_a_pose_is_approached() -> None:
    arm_servo, sent, _ = servo()
    assert arm_servo.take(pose(HERE[0] - 0.05), 0.0, NOW) == ""
    arm_servo.go_on(0.0, NOW, AT)
    there = KINEMATICS.tip_pose(sent[0].points[-1].positions).translation
    assert there[0] < HERE[0]
