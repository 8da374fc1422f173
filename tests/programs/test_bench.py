"""A robot with a program on a stepped clock: what the others do with its messages, and without them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseWithCovariance, Quaternion, TransformStamped, Twist
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk import ComponentNoted
from rbxcompose.testing import Bench
from rbxcompose.testing.manifests import check_text
from tests.programs.foreign import PATROL, patrol

PERIOD = 0.02  # [s]


class Driven:
    """The robot with the base played by the test."""

    def __init__(self, folder: Path) -> None:
        plan = check_text(patrol("foreign"), folder, others={"patrol.yaml": PATROL}).compilation.plan
        assert plan is not None
        self.bench = Bench(plan=plan)
        self.commands = self.bench.collect("cmd_vel", Twist)
        self.x = self.heading = 0.0

    def drive(self, seconds: float, *, talks: bool = True) -> None:
        """Let time pass, in which the base does what it is told, and says so or not."""
        for _ in range(round(seconds / PERIOD)):
            self.bench.advance(PERIOD)
            if talks:
                command = self.commands[-1] if self.commands else Twist()
                self.heading += command.angular.z * PERIOD
                self.x += command.linear.x * math.cos(self.heading) * PERIOD
                self.tell()

    def tell(self) -> None:
        turned = Quaternion(z=math.sin(self.heading / 2), w=math.cos(self.heading / 2))
        pose = Pose(position=Point(x=self.x), orientation=turned)
        header = Header(frame_id="odom")
        odometry = Odometry(header=header, child_frame_id="base_footprint", pose=PoseWithCovariance(pose=pose))
        self.bench.publish("odom", odometry)
        moved = TransformStamped(header=header, child_frame_id="base_footprint")
        self.bench.publish("/tf", TFMessage(transforms=(moved,)))


@pytest.fixture
def robot(tmp_path: Path) -> Driven:
    return Driven(tmp_path)


def test_where_time_is_stepped_a_program_does_not_run_and_says_so(robot: Driven) -> None:
    words = "base: does not run: robot time is stepped, and programs of others keep real time"
    assert robot.bench.texts().count(words) == 1


def test_a_program_that_a_signal_suspends_is_not_called_healthy_and_ps_notes_it(robot: Driven) -> None:
    program: Any = robot.bench.component("base")
    for is_suspended, level in ((True, Level.WARN), (True, Level.WARN), (False, Level.OK)):
        program._tell_suspension(is_suspended=is_suspended)
        assert program.state.level is level
    notes = [event for event in robot.bench.events if isinstance(event, ComponentNoted)]
    assert notes == [ComponentNoted("base", "is suspended by a signal"), ComponentNoted("base", "")]
    assert robot.bench.texts()[-2:] == ["base: is suspended by a signal", "base: is no longer suspended"]


def test_while_its_odometry_stays_away_no_command_is_left_standing_and_the_goal_goes_on_with_it(robot: Driven) -> None:
    robot.drive(1.0)
    assert robot.commands[-1].linear.x > 0.0
    robot.drive(3.0, talks=False)
    assert robot.commands[-1] == Twist()
    sent = len(robot.commands)
    robot.drive(20.0, talks=False)
    assert set(robot.commands[sent:]) == {Twist()}
    robot.drive(0.5)
    assert robot.commands[-1].linear.x > 0.0
