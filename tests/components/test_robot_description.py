from __future__ import annotations

from rbxcompose.msgs.std_msgs import String
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

URDF = '<robot name="cart"><link name="base"/></robot>'


def test_who_listens_early_or_late_is_given_the_text_once() -> None:
    robot = Bench(instance("robot_description", "robot_description", {"urdf": URDF}), start=False)
    early: list[str] = []
    late: list[str] = []
    topic = "/robot_description"
    robot.bus.subscribe("early", topic, String, Qos.LATCHED, lambda message: early.append(message.data))
    robot.advance(60.0)
    robot.bus.subscribe("late", topic, String, Qos.LATCHED, lambda message: late.append(message.data))
    robot.advance(60.0)
    assert early == late == [URDF]
