from __future__ import annotations

import pytest

from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.testing import Bench, instance

FORWARDS = Twist(linear=Vector3(x=0.4))


def bench() -> Bench:
    return Bench(instance("base", "diff_drive_sim", {"command_timeout": "0.5 s"}))


def drive(robot: Bench, seconds: float) -> None:
    for _ in range(round(seconds / 0.1)):
        robot.publish("/cmd_vel", FORWARDS)
        robot.advance(0.1)


def test_it_follows_commands_and_tells_where_it_is() -> None:
    robot = bench()
    odometry = robot.collect("/odom", Odometry)
    transforms = robot.collect("/tf", TFMessage)
    drive(robot, 2.0)
    assert odometry[-1].twist.twist.linear.x == pytest.approx(0.4)
    assert odometry[-1].pose.pose.position.x == pytest.approx(0.72, abs=0.01)
    link = transforms[-1].transforms[0]
    assert (link.header.frame_id, link.child_frame_id) == ("odom", "base_footprint")
    assert link.transform.translation.x == odometry[-1].pose.pose.position.x


@pytest.mark.parametrize("rate", [5, 10, 50, 100])
def test_it_moves_and_publishes_at_its_rate_and_gets_as_far(rate: int) -> None:
    robot = Bench(instance("base", "diff_drive_sim", {"rate": f"{rate} Hz"}))
    odometry = robot.collect("/odom", Odometry)
    drive(robot, 2.0)
    assert len(odometry) == pytest.approx(2 * rate, abs=1)
    assert odometry[-1].pose.pose.position.x == pytest.approx(0.4 * 1.8, abs=0.4 * 1.5 / rate + 0.01)
    robot.advance(1.5)
    assert odometry[-1].twist.twist.linear.x == 0.0


def test_it_brakes_when_no_command_comes() -> None:
    robot = bench()
    drive(robot, 2.0)
    odometry = robot.collect("/odom", Odometry)
    robot.advance(0.3)  # the last command is 0.4 s old now and still holds
    assert odometry[-1].twist.twist.linear.x == pytest.approx(0.4)
    robot.advance(0.7)
    assert odometry[-1].twist.twist.linear.x == 0.0


@pytest.mark.parametrize("action", ["stop", "brake"])
def test_it_comes_to_rest_whatever_is_commanded_when_it_must(action: str) -> None:
    robot = bench()
    drive(robot, 1.0)
    getattr(robot.host, action)()
    drive(robot, 0.5)
    assert robot.host.is_at_rest


def test_it_moves_again_after_a_release_only_when_commanded() -> None:
    robot = bench()
    drive(robot, 1.0)
    robot.host.stop()
    drive(robot, 0.5)
    robot.host.release()
    robot.advance(1.0)
    assert robot.host.is_at_rest
    drive(robot, 0.5)
    assert not robot.host.is_at_rest


def test_the_summary_tells_the_way_driven() -> None:
    robot = bench()
    drive(robot, 2.0)
    robot.advance(2.0)
    assert robot.host.summary()["base"]["distance driven"] == "0.96 m"


@pytest.mark.parametrize(
    ("speeds", "message"),
    [
        ([0.7], "commands: 1 cut to the limits"),
        ([5.0, 5.0], "commands: 2 dropped as absurd"),
        ([5.0, 0.7], "commands: 1 dropped as absurd, 1 cut to the limits"),
    ],
)
def test_commands_that_are_not_followed_are_counted_by_what_was_done_with_them(
    speeds: list[float], message: str
) -> None:
    robot = bench()
    told = robot.statuses("base")
    for speed in speeds:
        robot.publish("/cmd_vel", Twist(linear=Vector3(x=speed)))
    robot.advance(0.1)
    assert message in [status.message for status in told]
