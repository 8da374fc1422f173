"""Driving and charging together, as the patrol robot does it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.config import Place
from rbxcompose.base.geometry import Pose2, quaternion_from_yaw
from rbxcompose.bus.services import ServedRequest
from rbxcompose.msgs.geometry_msgs import (
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    Vector3,
)
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.poses import pose_in
from rbxcompose.msgs.rbxcompose_msgs import Recharge, SetBatteryLevel
from rbxcompose.msgs.stamps import to_nanoseconds, to_seconds
from rbxcompose.msgs.std_msgs import Float32, Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk import Ended, Outcome, SentGoal
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

DOCK = Place("dock", 0.5, 0.5, 0.0)


def bench(speed: str = "0.3 m/s") -> Bench:
    return Bench(
        instance("base", "diff_drive_sim"),
        instance("transforms", "transforms"),
        instance("battery", "battery_sim", {"runtime": "60 s"}),
        instance("go_to", "go_to", {"speed": speed}),
        instance("charger", "charger", {"dock": "dock"}, [DOCK]),
    )


def goal(x: float, y: float, heading: float = 0.0, frame: str = "map") -> NavigateToPose.Goal:
    pose = Pose(position=Point(x=x, y=y), orientation=Quaternion(*quaternion_from_yaw(heading)))
    return NavigateToPose.Goal(pose=PoseStamped(header=Header(frame_id=frame), pose=pose))


def come_to(robot: Bench, x: float) -> None:
    moved = TransformStamped(header=Header(frame_id="map"), child_frame_id="base_footprint")
    robot.publish("/tf", TFMessage(transforms=(replace(moved, transform=Transform(translation=Vector3(x=x))),)))


class Driver:
    """A client that keeps what it is told."""

    def __init__(self, robot: Bench) -> None:
        self.robot = robot
        self.ended: list[Ended[NavigateToPose.Result]] = []
        self.told: list[NavigateToPose.Feedback] = []
        self.client = robot.bus.action_client("bench", "/go_to", NavigateToPose)

    def send(self, request: NavigateToPose.Goal) -> SentGoal:
        return self.client(request, self.ended.append, self.told.append)

    def pose(self) -> Pose2:
        pose: Pose2 = self.robot.component("base").core.pose  # type: ignore[attr-defined]
        return pose


def test_it_drives_to_a_pose_and_turns_to_its_heading() -> None:
    robot = bench()
    driver = Driver(robot)
    robot.advance(0.1)
    driver.send(goal(1.0, 0.0, math.pi / 2))
    assert robot.run_until(lambda: bool(driver.ended), 10.0)
    assert driver.ended[0].outcome is Outcome.SUCCEEDED
    assert driver.pose().distance(Pose2(1.0, 0.0)) < 0.05
    assert driver.pose().heading == pytest.approx(math.pi / 2, abs=math.radians(3))
    first, *_, last = driver.told
    assert first.distance_remaining > last.distance_remaining
    assert (first.current_pose.header.frame_id, last.current_pose.header.frame_id) == ("map", "map")
    assert to_nanoseconds(first.current_pose.header.stamp) < to_nanoseconds(last.current_pose.header.stamp)
    assert pose_in(first.current_pose.pose).distance(Pose2()) < 0.05
    assert pose_in(last.current_pose.pose).distance(driver.pose()) < 0.05
    assert pose_in(last.current_pose.pose).heading == pytest.approx(math.pi / 2, abs=math.radians(6))
    assert to_seconds(first.navigation_time) < 0.1
    took = to_seconds(last.navigation_time)
    assert 0.7 * took < to_seconds(first.estimated_time_remaining) < 1.1 * took
    assert to_seconds(last.estimated_time_remaining) < 0.1


def test_a_drive_takes_no_longer_than_a_message_can_say() -> None:
    robot = bench(speed="0.00001 m/s")
    driver = Driver(robot)
    robot.advance(0.1)
    driver.send(goal(90_000.0, 0.0))
    robot.advance(0.2)
    assert driver.told[-1].estimated_time_remaining.sec == 2**31 - 1


def test_a_cancelled_goal_ends_canceled_and_the_base_rests() -> None:
    robot = bench()
    driver = Driver(robot)
    robot.advance(0.1)
    sent = driver.send(goal(1.0, 0.0))
    robot.advance(2.0)
    sent.cancel()
    robot.advance(1.0)
    assert [end.outcome for end in driver.ended] == [Outcome.CANCELED]
    assert robot.host.is_at_rest


def test_a_newer_goal_replaces_the_current_one() -> None:
    robot = bench()
    driver = Driver(robot)
    robot.advance(0.1)
    driver.send(goal(1.0, 0.0))
    robot.advance(1.0)
    driver.send(goal(0.0, 0.5))
    assert robot.run_until(lambda: len(driver.ended) == 2, 20.0)
    assert [end.outcome for end in driver.ended] == [Outcome.ABORTED, Outcome.SUCCEEDED]
    assert driver.ended[0].result == NavigateToPose.Result(error_msg="replaced by a newer goal")
    assert driver.pose().distance(Pose2(0.0, 0.5)) < 0.05


def test_a_goal_that_cannot_be_reached_ends_with_the_reason() -> None:
    robot = Bench(instance("transforms", "transforms"), instance("go_to", "go_to"))
    driver = Driver(robot)
    robot.advance(0.1)
    driver.send(goal(1.0, 0.0))
    robot.advance(1.5)
    assert driver.ended == []  # the base may have started again, and soon know where it is
    robot.advance(1.0)
    why = "the position of the base is unknown in 'map'"
    assert [end.result for end in driver.ended] == [NavigateToPose.Result(error_code=1, error_msg=why)]


def test_a_goal_waits_at_rest_while_no_position_comes_and_goes_on_with_the_next() -> None:
    robot = Bench(instance("transforms", "transforms"), instance("go_to", "go_to"))
    driver, commands = Driver(robot), robot.collect("cmd_vel", Twist)
    come_to(robot, 0.0)
    driver.send(goal(1.0, 0.0))
    robot.advance(1.0)
    assert commands[-1].linear.x > 0.0
    robot.advance(60.0)  # as when the link to the host of the base is cut
    why = "no position of the base in 'map' has come for 2 s: waits for the next"
    assert (driver.ended, commands[-1], str(robot.records).count(why)) == ([], Twist(), 1)
    come_to(robot, 0.5)
    robot.advance(1.5)
    assert commands[-1].linear.x > 0.0
    come_to(robot, 1.0)
    robot.advance(0.2)
    assert [end.outcome for end in driver.ended] == [Outcome.SUCCEEDED]


def test_a_goal_ends_when_odometry_has_begun_again_and_the_next_counts_from_there() -> None:
    robot = Bench(instance("transforms", "transforms"), instance("go_to", "go_to"))
    driver, commands = Driver(robot), robot.collect("cmd_vel", Twist)
    come_to(robot, 0.0)
    driver.send(goal(1.0, 0.0))
    for x in (0.1, 0.2, 0.3, 0.4, 0.5):
        robot.advance(0.35)
        come_to(robot, x)
    robot.advance(1.5)  # a driver that was killed takes its time to start
    come_to(robot, 0.0)
    robot.advance(0.1)
    why = "the odometry of the base has jumped, so its position is not known any more"
    assert [end.result for end in driver.ended] == [NavigateToPose.Result(error_code=1, error_msg=why)]
    assert commands[-1] == Twist()
    driver.send(goal(1.0, 0.0))
    robot.advance(0.5)
    assert commands[-1].linear.x > 0.0


def test_a_goal_in_another_frame_is_refused() -> None:
    robot = bench()
    driver = Driver(robot)
    robot.advance(0.1)
    driver.send(goal(1.0, 0.0, frame="moon"))
    robot.advance(0.1)
    assert [end.outcome for end in driver.ended] == [Outcome.REJECTED]


def test_a_stop_cancels_the_goal_and_refuses_new_ones() -> None:
    robot = bench()
    driver = Driver(robot)
    robot.advance(0.1)
    driver.send(goal(1.0, 0.0))
    robot.advance(1.0)
    robot.host.stop()
    robot.advance(1.0)
    driver.send(goal(1.0, 0.0))
    robot.advance(0.1)
    assert [end.outcome for end in driver.ended] == [Outcome.CANCELED, Outcome.REJECTED]


@pytest.mark.parametrize(("x", "heading"), [(math.inf, 0), (math.nan, 0), (1e300, 0), (-1e6, 0), (0, math.nan)])
def test_a_goal_that_no_robot_can_reach_is_refused(x: float, heading: float) -> None:
    robot = bench()
    driver = Driver(robot)
    robot.advance(0.1)
    driver.send(goal(x, 0.0, heading))
    robot.advance(0.1)
    assert [end.outcome for end in driver.ended] == [Outcome.REJECTED]


def test_charging_is_refused_away_from_the_dock_and_done_at_it() -> None:
    robot = bench()
    driver = Driver(robot)
    charged: list[Ended[Recharge.Result]] = []
    charger = robot.bus.action_client("bench", "/recharge", Recharge)
    robot.advance(5.0)
    charger(Recharge.Goal(), charged.append)
    robot.advance(0.5)
    assert [end.outcome for end in charged] == [Outcome.REJECTED]
    driver.send(goal(0.5, 0.5))
    robot.run_until(lambda: bool(driver.ended), 10.0)
    charger(Recharge.Goal(), charged.append)
    robot.advance(1.0)
    assert charged[1].outcome is Outcome.SUCCEEDED
    assert charged[1].result == Recharge.Result(level=100.0)


class Battery:
    """Plays the battery: it tells its level once a second from `phase` [s] on, and answers `delay` [s] after it is set.

    What it tells just when it is set may be overtaken by a lower level, so that nobody sees it.
    """

    def __init__(self, robot: Bench, *, phase: float, delay: float, tells_at_once: bool, drain: float) -> None:
        self.robot, self.delay, self.tells_at_once, self.drain = robot, delay, tells_at_once, drain
        self.level = 40.0
        robot.bus.serve_later("battery", "set_battery_level", SetBatteryLevel, self.set)
        robot.scheduler.at(robot.scheduler.now + phase, "battery", self.step)

    def set(self, request: ServedRequest[SetBatteryLevel.Request, SetBatteryLevel.Response]) -> None:
        self.level = request.message.value
        if self.tells_at_once:
            self.tell()
        when = self.robot.scheduler.now + self.delay
        self.robot.scheduler.at(when, "battery", lambda: request.reply(SetBatteryLevel.Response()))

    def step(self) -> None:
        self.level = max(0.0, self.level - self.drain)
        self.tell()
        self.robot.scheduler.at(self.robot.scheduler.now + 1.0, "battery", self.step)

    def tell(self) -> None:
        self.robot.publish("battery_level", Float32(data=self.level), Qos.STATE)


def charge(robot: Bench) -> list[Ended[Recharge.Result]]:
    charged: list[Ended[Recharge.Result]] = []
    robot.bus.action_client("bench", "/recharge", Recharge)(Recharge.Goal(), charged.append)
    return charged


def at_the_dock() -> Bench:
    here = Place("dock", 0.0, 0.0, 0.0)
    return Bench(
        instance("base", "diff_drive_sim"),
        instance("transforms", "transforms"),
        instance("charger", "charger", {"dock": "dock"}, [here]),
    )


@given(
    phase=st.floats(0.0, 1.0),
    delay=st.floats(0.0, 0.3),
    starts=st.floats(0.1, 1.1),
    drain=st.floats(0.1, 20.0),
    tells_at_once=st.booleans(),
)
def test_whenever_the_battery_steps_the_end_of_a_charge_is_seen(
    phase: float, delay: float, starts: float, drain: float, tells_at_once: bool
) -> None:
    robot = at_the_dock()
    Battery(robot, phase=phase, delay=delay, tells_at_once=tells_at_once, drain=drain)
    robot.advance(starts)
    charged = charge(robot)
    assert robot.run_until(lambda: bool(charged), 2.0)
    assert charged[0].outcome is Outcome.SUCCEEDED


@pytest.mark.parametrize(("answers", "why"), [(True, "the battery reported no level for 10 s"), (False, "no reply")])
def test_a_battery_that_tells_nothing_ends_the_charge_with_a_reason(answers: bool, why: str) -> None:
    robot = at_the_dock()
    Battery(robot, phase=1e6, delay=0.1 if answers else 1e6, tells_at_once=False, drain=1.0)
    robot.advance(0.1)
    charged = charge(robot)
    assert robot.run_until(lambda: bool(charged), 11.0)
    assert charged[0].outcome is Outcome.ABORTED
    assert why in str(robot.records)
