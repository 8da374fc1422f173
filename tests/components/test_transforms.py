"""The frames of a body on the bus: fixed ones once, moving ones where the joints are."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.domains.body.components.transforms import TransformsConfig, body_of
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_nanoseconds, to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

LIMITS = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
URDF = f"""<robot name="r">
  <link name="base_footprint"/> <link name="post"/> <link name="head"/> <link name="jaw"/> <link name="eye"/>
  <joint name="stand" type="fixed"><parent link="base_footprint"/><child link="post"/><origin xyz="0 0 1"/></joint>
  <joint name="pan" type="revolute"><parent link="post"/><child link="head"/><axis xyz="0 0 1"/>{LIMITS}</joint>
  <joint name="bite" type="prismatic"><parent link="head"/><child link="jaw"/>{LIMITS}</joint>
  <joint name="look" type="revolute"><parent link="head"/><child link="eye"/><axis xyz="0 0 1"/>{LIMITS}
    <mimic joint="pan" multiplier="-2"/></joint>
</robot>"""


class Listener:
    """Keeps the newest transform of each frame, and how many messages came."""

    def __init__(self, robot: Bench) -> None:
        self.robot = robot
        self.moving: dict[str, float] = {}
        self.static: set[str] = set()
        self.count = 0
        self.stamps: list[tuple[str, float]] = []  # [s] of each transform that came
        robot.bus.subscribe("listener", "/tf", TFMessage, Qos.STATE, self._moved)
        robot.bus.subscribe("listener", "/tf_static", TFMessage, Qos.LATCHED, self._fixed)
        self.send = robot.bus.publisher("source", "/joint_states", JointState, Qos.STATE)

    def _moved(self, message: TFMessage) -> None:
        self.count += 1
        for one in message.transforms:
            at = one.transform
            self.stamps.append((one.child_frame_id, to_nanoseconds(one.header.stamp) / 1e9))
            self.moving[one.child_frame_id] = at.translation.x or 2 * math.atan2(at.rotation.z, at.rotation.w)

    def _fixed(self, message: TFMessage) -> None:
        self.static |= {transform.child_frame_id for transform in message.transforms}

    def move(self, *, stamp: float = 0.0, **positions: float) -> None:
        """Report joints; a stamp of 0 is none."""
        header = Header(stamp=to_time(round(stamp * 1e9)))
        self.send(JointState(header=header, name=tuple(positions), position=np.array(list(positions.values()))))
        self.robot.advance(0.01)


@pytest.fixture
def listener() -> Listener:
    robot = Bench(instance("transforms", "transforms", {"urdf": URDF}), start=False)
    made = Listener(robot)
    robot.advance(0.15)
    return made


def test_fixed_frames_are_published_once_and_moving_ones_at_rest_until_a_joint_is_reported(listener: Listener) -> None:
    assert listener.static == {"odom", "post"}
    listener.robot.advance(1.0)
    assert listener.moving == {"head": 0.0, "jaw": 0.0, "eye": 0.0}
    assert 9 <= listener.count <= 12


def test_a_joint_moves_its_link_and_those_that_mimic_it_at_once(listener: Listener) -> None:
    listener.move(pan=0.5)
    assert listener.moving == pytest.approx({"head": 0.5, "jaw": 0.0, "eye": -1.0})


def test_a_link_is_where_it_was_when_the_joint_was_measured_not_when_that_was_heard(listener: Listener) -> None:
    listener.stamps.clear()
    listener.move(bite=0.25, stamp=0.125)
    assert listener.stamps == [("jaw", 0.125)]


def test_what_was_measured_just_before_the_start_is_not_older_than_what_was_published() -> None:
    clock = SteppedClock()
    clock.advance_to(1.0)
    looking = instance("looking", "frame_target", {"frame": "head"})
    robot = Bench(instance("transforms", "transforms", {"urdf": URDF}), looking, clock=clock)
    listener = Listener(robot)
    listener.move(pan=0.5, bite=0.25, stamp=0.98)
    robot.advance(0.5)
    assert min(stamp for name, stamp in listener.stamps if name == "head") == 0.98
    assert not [text for text in robot.texts() if "went back" in text]


@pytest.mark.parametrize("stamp", [0.0, 1e9, float(2**31 - 1)])
def test_a_stamp_of_another_clock_does_not_reach_the_tree(listener: Listener, stamp: float) -> None:
    now = listener.robot.clock.now()
    listener.stamps.clear()
    listener.move(bite=0.25, stamp=stamp)
    listener.robot.advance(1.0)
    assert {now <= value <= now + 1.1 for _, value in listener.stamps} == {True}


def test_a_joint_that_falls_silent_is_published_again_by_the_clock_of_who_reported_it(listener: Listener) -> None:
    now = listener.robot.clock.now()
    listener.move(bite=0.25, stamp=now - 0.1)
    listener.robot.advance(1.0)
    stamps = [stamp for name, stamp in listener.stamps if name == "jaw" and stamp > now]
    assert stamps == sorted(stamps)
    assert len(stamps) >= 8
    assert max(stamps) <= listener.robot.clock.now() - 0.1 + 1e-9


def test_what_is_reported_often_is_published_as_often_and_not_once_more(listener: Listener) -> None:
    listener.move(pan=0.0, bite=0.0)
    listener.robot.advance(0.1)
    listener.count = 0
    for step in range(50):
        listener.move(pan=0.01 * step, bite=0.001 * step)
    assert listener.count == 50


def test_joints_of_several_sources_are_merged(listener: Listener) -> None:
    listener.move(pan=0.5)
    listener.move(bite=0.25)
    listener.robot.advance(0.5)
    assert listener.moving == pytest.approx({"head": 0.5, "jaw": 0.25, "eye": -1.0})


def test_what_is_no_position_of_a_moving_joint_is_ignored(listener: Listener) -> None:
    before = listener.count
    listener.move(stand=1.0, nothing=1.0)
    assert listener.count == before
    listener.move(pan=math.nan, bite=0.5)
    assert listener.moving["head"] == 0.0
    assert listener.moving["jaw"] == 0.5


def test_a_body_is_parsed_once_and_a_robot_without_one_has_no_joints() -> None:
    assert body_of(URDF) is body_of(URDF)
    assert not body_of("").moving


@pytest.mark.parametrize("urdf", ["<robot", '<robot><link name="a"/><link name="b"/></robot>', "<sdf/>"])
def test_what_is_no_body_is_refused_when_it_is_configured(urdf: str) -> None:
    with pytest.raises(ValueError, match=r"XML|connected|root"):
        TransformsConfig(urdf=urdf)
