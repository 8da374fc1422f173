"""A policy commands by a network that the tests make; whatever is wrong with its answers, what it commands rests."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from rbxcompose.base.findings import Finding
from rbxcompose.base.levels import Level
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.policies.components.policy import (
    NothingObservedError,
    ObservationConfig,
    PolicyConfig,
    PolicyCore,
    PolicyNetwork,
    PolicyNetworkError,
    PolicyOutputConfig,
    observed,
)
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav2_msgs import Wait
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_duration
from rbxcompose.msgs.std_msgs import Float32, Float64MultiArray
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.msgs.trajectory_msgs import JointTrajectory
from rbxcompose.sdk import Ended, Outcome, SentGoal
from rbxcompose.testing import Bench, instance
from tests.policies.networks import network

LIMITS = dict.fromkeys("ab", PolicyOutputConfig(least=-1.0, most=1.0, jump=0.2))
NAN, INF = math.nan, math.inf


def judged(core: PolicyCore, answer: Sequence[float], began: float = 0.0, took: float = 0.01) -> str:
    return core.judge(answer, [0.0, 0.0], began, began + took)


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ((NAN, 0.0), "'a' is not finite"),
        ((0.0, -INF), "'b' is not finite"),
        ((0.0, 1.5), "'b' is 1.5, beyond -1 to 1"),
        ((0.3, 0.0), "'a' jumps from 0 to 0.3, by more than 0.2"),
        ((0.0,), "an answer has 1 numbers, and not 2"),
    ],
)
def test_what_is_wrong_is_refused_and_counted(answer: tuple[float, ...], said: str) -> None:
    core = PolicyCore(LIMITS, 0.1)
    assert judged(core, answer) == said
    assert (core.counts["refused"], core.counts["sent"], core.last) == (1, 0, None)


def test_what_is_late_is_not_sent() -> None:
    core = PolicyCore(LIMITS, 0.1)
    assert judged(core, (0.0, 0.0), took=0.15) == "an answer took 150 ms, and is late after 100 ms"
    assert (core.counts["late"], core.counts["sent"]) == (1, 0)


def test_rest_is_told_once_when_the_last_good_answer_is_old_and_the_next_one_begins_anew() -> None:
    core = PolicyCore(LIMITS, 0.1)
    assert judged(core, (0.2, 0.0)) == judged(core, (0.4, 0.0), began=0.05) == ""
    assert judged(core, (NAN, 0.0), began=0.1)
    assert [core.must_rest(time) for time in (0.1, 0.15, 0.2, 0.3)] == [False, False, True, False]
    assert judged(core, (0.4, 0.0), began=0.4).startswith("'a' jumps from 0 to 0.4")


@given(st.lists(st.tuples(*[st.floats() for _ in LIMITS]), max_size=20))
def test_nothing_that_is_sent_is_beyond_limits_or_far_from_what_was_sent(answers: list[tuple[float, float]]) -> None:
    core, before = PolicyCore(LIMITS, 0.1), (0.0, 0.0)
    for answer in answers:
        if not judged(core, answer):
            assert core.last is not None
            assert all(-1 <= value <= 1 for value in core.last)
            assert all(abs(value - old) <= 0.2 + 2e-6 for value, old in zip(core.last, before, strict=True))
            before = (core.last[0], core.last[1])
    assert core.counts["sent"] + core.counts["refused"] == len(answers)


def test_numbers_are_observed_in_the_order_in_which_they_are_written() -> None:
    states = JointState(name=("a", "b", "c"), position=np.array([1.0, 2.0, 3.0]), velocity=np.array([4.0, 5.0, 6.0]))
    config = ObservationConfig(topic="joint_states", joints=["c", "a"], fields=["velocity", "position"])
    assert (observed(config, states), config.length) == ([6.0, 4.0, 3.0, 1.0], 4)
    numbers = ObservationConfig(topic="goal", message="std_msgs/Float64MultiArray", fields=["data"], size=2)
    assert observed(numbers, Float64MultiArray(data=np.array([7.0, 8.0]))) == [7.0, 8.0]
    with pytest.raises(NothingObservedError, match="'data' of 'goal' has 1 numbers, and not 2"):
        observed(numbers, Float64MultiArray(data=np.array([7.0])))
    with pytest.raises(NothingObservedError, match="'joint_states' has no velocity of 'c'"):
        observed(config, JointState(name=("c",), position=np.array([1.0])))


@pytest.mark.parametrize(
    ("config", "said"),
    [
        ({"message": "nav_msgs/Odometry", "fields": ["twist.twist.linear.w"]}, "has no field 'w'"),
        ({"message": "nav_msgs/Odometry", "fields": ["pose.pose"]}, "not numbers"),
        ({"message": "nav_msgs/Odometry", "joints": ["a"], "fields": ["pose.pose.position.x"]}, "has joints"),
        ({"joints": ["a"], "fields": ["name"]}, "a joint has no field 'name'"),
        ({"message": "nav_msgs/Odometry", "fields": ["pose.covariance"]}, "has 36 numbers, and not 1"),
        ({"message": "std_msgs/Float32", "fields": ["data"], "size": 2}, "has 1 numbers, and not 2"),
        ({"joints": ["a", "a"]}, "a joint is there twice"),
    ],
)
def test_what_cannot_be_observed_is_found_in_the_manifest(config: Mapping[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        ObservationConfig.model_validate({"topic": "states", **config})


def test_a_joint_that_is_commanded_is_observed_and_the_deadline_is_longer_than_a_period() -> None:
    limits = {"least": -1, "most": 1, "jump": 0.1}
    config: dict[str, Any] = {
        "model": "reach.onnx",
        "observes": [{"topic": "joint_states", "joints": ["a"], "fields": ["position"]}],
        "commands": {"topic": "arm/joint_trajectory", "outputs": {"b": limits}},
    }
    with pytest.raises(ValidationError, match="it must observe the position of 'b'"):
        PolicyConfig.model_validate(config)
    with pytest.raises(ValidationError, match="at 5 Hz there is an answer every 200 ms"):
        PolicyConfig.model_validate({**config, "rate": "5 Hz"})


def test_a_network_takes_and_gives_vectors(tmp_path: Path) -> None:
    for is_batch in (True, False):
        made = PolicyNetwork(network(tmp_path / "sum.onnx", [[1, 0], [1, 1], [0, 1]], [0, 10], is_batch=is_batch))
        assert (made.takes, made.gives) == (3, 2)
        assert made.answer([1.0, 2.0, 3.0]) == [3.0, 15.0]
        with pytest.raises(PolicyNetworkError, match="the network fails"):
            made.answer([1.0])
    (tmp_path / "text.onnx").write_text("no network")
    for path, said in [
        (tmp_path / "nowhere.onnx", "there is no file"),
        (tmp_path / "text.onnx", "'text.onnx' is no network in ONNX"),
        (tmp_path, "cannot be used"),
        (network(tmp_path / "two.onnx", [[1]], [0], inputs=2), "it has 2 inputs"),
    ]:
        with pytest.raises(PolicyNetworkError, match=said):
            PolicyNetwork(path)


class Driving:
    """A policy that drives as fast as a topic says, observed ten times per second."""

    def __init__(self, folder: Path, **config: Any) -> None:
        path = network(folder / "steer.onnx", [[1, 0]], [0, 0.1])
        limits = {"least": -0.5, "most": 0.5, "jump": 0.2}
        made = {
            "model": str(path),
            "observes": [{"topic": "wish", "message": "std_msgs/Float32", "fields": ["data"]}],
            "commands": {
                "topic": "cmd_vel/policy",
                "message": "geometry_msgs/Twist",
                "outputs": {"linear.x": limits, "angular.z": limits},
            },
            "starts": True,
            **config,
        }
        self.bench = Bench(instance("steer", "policy", made))
        self.sent = self.bench.collect("/cmd_vel/policy", Twist)
        self.statuses = self.bench.statuses("steer")

    def wish(self, value: float, seconds: float = 0.1) -> list[tuple[float, float]]:
        """What is sent in a time in which a wish comes ten times per second."""
        self.sent.clear()
        for _ in range(round(seconds * 10)):
            self.bench.publish("/wish", Float32(data=value))
            self.bench.advance(0.1)
        return [(round(twist.linear.x, 3), round(twist.angular.z, 3)) for twist in self.sent]

    def switch(self, *, on: bool) -> SetBool.Response:
        answer: SetBool.Response = self.bench.component("steer").on_switch(SetBool.Request(data=on))  # type: ignore[attr-defined]
        return answer

    def counts(self) -> dict[str, str]:
        self.bench.advance(1.1)
        return {value.key: value.value for value in self.statuses[-1].values}


def test_it_sends_what_its_network_answers(tmp_path: Path) -> None:
    driving = Driving(tmp_path)
    assert set(driving.wish(0.2, 0.5)) == {(0.2, 0.1)}
    driving.bench.advance(0.6)
    assert driving.statuses[-1].level in (Level.OK, Level.ERROR)


def test_without_an_observation_it_rests_once_and_is_silent(tmp_path: Path) -> None:
    driving = Driving(tmp_path)
    driving.wish(0.2, 0.5)
    driving.bench.advance(0.5)  # the last observation still counts
    driving.sent.clear()
    driving.bench.advance(3.0)
    assert [(twist.linear.x, twist.angular.z) for twist in driving.sent][-1:] == [(0.0, 0.0)]
    assert len([twist for twist in driving.sent if twist.linear.x == 0]) == 1
    assert driving.statuses[-1].level == Level.ERROR
    assert driving.statuses[-1].message == "nothing comes on 'wish'"
    assert int(driving.counts()["unseen"]) > 20


@pytest.mark.parametrize("wrong", [NAN, INF, 0.8])
def test_what_is_wrong_is_not_sent_but_a_rest_and_it_is_reported(tmp_path: Path, wrong: float) -> None:
    driving = Driving(tmp_path)
    driving.wish(0.2, 0.5)
    assert driving.wish(wrong, 2.0) == [(0.0, 0.0)]
    assert driving.statuses[-1].level == Level.ERROR
    assert int(driving.counts()["refused"]) >= 20
    assert (0.2, 0.1) in driving.wish(0.2, 0.5), "it goes on once answers are right again"


def test_a_jump_is_refused_while_it_drives(tmp_path: Path) -> None:
    driving = Driving(tmp_path)
    assert (0.2, 0.1) in driving.wish(0.2, 0.3)
    assert driving.wish(-0.2, 0.1) == []
    assert (0.3, 0.1) in driving.wish(0.3, 0.2)


def test_an_answer_that_takes_too_long_is_late(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    driving = Driving(tmp_path)
    driving.wish(0.2, 0.5)
    policy: Any = driving.bench.component("steer")
    answer, clock = policy.network.answer, driving.bench.clock

    def slow(vector: Sequence[float]) -> list[float]:
        monkeypatch.setattr(clock, "now", lambda: now() + 0.3)
        found: list[float] = answer(vector)
        return found

    now = clock.now
    monkeypatch.setattr(policy.network, "answer", slow)
    policy.on_switch(SetBool.Request(data=True))
    before = policy.core.counts["sent"]
    policy.step(0.1)
    monkeypatch.undo()
    assert (policy.core.counts["late"], policy.core.counts["sent"]) == (1, before)


def test_it_is_off_until_it_is_switched_on_and_after_a_stop(tmp_path: Path) -> None:
    driving = Driving(tmp_path, starts=False)
    assert driving.wish(0.2, 0.5) == []
    assert driving.switch(on=True).success
    assert (0.2, 0.1) in driving.wish(0.2, 0.5)
    driving.bench.host.stop()
    assert not driving.switch(on=True).success
    assert driving.wish(0.2, 0.5)[1:] == []
    driving.bench.host.release()
    assert driving.wish(0.2, 0.5) == [], "a release does not start motion"
    assert driving.switch(on=True).success
    assert (0.2, 0.1) in driving.wish(0.2, 0.5)
    assert driving.switch(on=False).success
    assert driving.wish(0.2, 0.5) == [(0.0, 0.0)], "it rests once"


class Running(Driving):
    """A policy that is off, and runs for a goal."""

    def __init__(self, folder: Path, **config: Any) -> None:
        super().__init__(folder, starts=False, **config)
        self.client = self.bench.bus.action_client("bench", "/run_policy", Wait)
        self.ended: list[Ended[Wait.Result]] = []
        self.bench.advance(0.1)

    def run(self, seconds: float) -> SentGoal:
        return self.client(Wait.Goal(time=to_duration(seconds)), self.ended.append)

    @property
    def ends(self) -> list[tuple[Outcome, str]]:
        return [(end.outcome, end.message or (end.result.error_msg if end.result else "")) for end in self.ended]


def test_a_goal_runs_it_for_a_time_and_leaves_it_off_and_at_rest(tmp_path: Path) -> None:
    running = Running(tmp_path)
    running.run(2.0)
    assert (0.2, 0.1) in running.wish(0.2, 1.8)
    assert running.ends == []
    assert running.wish(0.2, 0.5)[-1] == (0.0, 0.0)
    assert running.ends == [(Outcome.SUCCEEDED, "")]
    assert running.ended[0].result == Wait.Result(total_elapsed_time=to_duration(2.0))
    assert running.wish(0.2, 0.5) == []


def test_a_goal_that_is_cancelled_leaves_it_off_though_it_had_been_switched_on(tmp_path: Path) -> None:
    running = Running(tmp_path)
    assert running.switch(on=True).success
    goal = running.run(60.0)
    assert (0.2, 0.1) in running.wish(0.2, 1.0)
    goal.cancel()
    assert running.wish(0.2, 0.5)[-1] == (0.0, 0.0)
    assert [outcome for outcome, _ in running.ends] == [Outcome.CANCELED]
    assert running.wish(0.2, 0.5) == []


def test_a_newer_goal_replaces_an_older_one_and_has_its_own_time(tmp_path: Path) -> None:
    running = Running(tmp_path)
    running.run(1.0)
    running.wish(0.2, 0.8)
    running.run(2.0)
    assert (0.2, 0.1) in running.wish(0.2, 1.5)
    assert [outcome for outcome, _ in running.ends] == [Outcome.ABORTED]
    running.wish(0.2, 1.0)
    assert [outcome for outcome, _ in running.ends] == [Outcome.ABORTED, Outcome.SUCCEEDED]


def test_a_paused_goal_rests_and_keeps_its_time(tmp_path: Path) -> None:
    running = Running(tmp_path)
    running.run(2.0)
    running.wish(0.2, 1.0)
    pause = running.bench.bus.client("bench", "/run_policy/pause", SetBool)
    pause(SetBool.Request(data=True), lambda _: None)
    assert running.wish(0.2, 5.0)[-1] == (0.0, 0.0)
    assert running.statuses[-1].message == "is paused"
    pause(SetBool.Request(data=False), lambda _: None)
    assert (0.2, 0.1) in running.wish(0.2, 0.8)
    assert running.ends == []
    running.wish(0.2, 0.5)
    assert [outcome for outcome, _ in running.ends] == [Outcome.SUCCEEDED]


def test_a_goal_fails_with_the_reason_when_nothing_can_be_sent_or_it_is_switched_off(tmp_path: Path) -> None:
    running = Running(tmp_path)
    running.run(60.0)
    running.wish(0.2, 1.0)
    running.bench.advance(3.0)
    assert running.ends == [(Outcome.ABORTED, "nothing comes on 'wish'")]
    assert running.wish(0.2, 0.5) == []
    running.run(60.0)
    running.wish(0.2, 1.0)
    assert running.switch(on=False).success
    running.wish(0.2, 0.5)
    assert running.ends[1:] == [(Outcome.ABORTED, "the policy has been switched off")]


def test_a_goal_needs_a_robot_that_may_move_and_a_network(tmp_path: Path) -> None:
    running = Running(tmp_path)
    running.bench.host.stop()
    running.run(5.0)
    running.bench.advance(0.2)
    assert [outcome for outcome, _ in running.ends] == [Outcome.REJECTED]
    running.bench.host.release()
    running.run(5.0)
    assert (0.2, 0.1) in running.wish(0.2, 1.0)
    running.bench.host.stop()
    running.bench.advance(0.2)
    running.bench.host.release()
    assert running.wish(0.2, 0.5) == []
    assert [outcome for outcome, _ in running.ends[1:]] == [Outcome.CANCELED]
    lacking = Running(tmp_path, model=str(tmp_path / "nowhere.onnx"))
    lacking.run(5.0)
    lacking.bench.advance(0.2)
    assert lacking.ends == [(Outcome.ABORTED, f"there is no file '{tmp_path / 'nowhere.onnx'}'")]


@pytest.mark.parametrize("is_replaced", [False, True])
def test_after_a_failure_or_another_plan_it_is_off_until_it_is_switched_on(tmp_path: Path, is_replaced: bool) -> None:
    driving = Driving(tmp_path)
    assert (0.2, 0.1) in driving.wish(0.2, 0.5)
    if is_replaced:
        driving.bench.host.prepare(driving.bench.plan.instances)
        driving.bench.host.activate(["steer"])
    else:
        driving.bench.host.failed("steer", RuntimeError("planted"))
    driving.bench.advance(1.0)
    assert driving.wish(0.2, 0.5) == []
    assert driving.switch(on=True).success
    assert (0.2, 0.1) in driving.wish(0.2, 0.5)


def test_without_a_network_it_says_so_and_cannot_be_switched_on(tmp_path: Path) -> None:
    driving = Driving(tmp_path, model=str(tmp_path / "nowhere.onnx"))
    assert driving.wish(0.2, 0.5) == []
    answer = driving.switch(on=True)
    assert (answer.success, answer.message) == (False, f"there is no file '{tmp_path / 'nowhere.onnx'}'")
    driving.bench.advance(1.1)
    assert driving.statuses[-1].level == Level.ERROR


BASE = """
rbx: 1
kind: Robot
name: learner
components:
  base: {type: diff_drive_sim, command_timeout: 0.5 s}
  steer:
    type: policy
    model: steer.onnx
    starts: true
    observes: [{topic: wish, message: std_msgs/Float32, fields: [data]}]
    commands:
      topic: cmd_vel/policy
      message: geometry_msgs/Twist
      outputs: {linear.x: {least: -0.2, most: 0.3, jump: 0.3}}
muxes:
  cmd_vel:
    inputs:
      teleop: {priority: 100, timeout: 0.5 s}
      policy: {from: steer, priority: 10, timeout: 0.5 s}
"""


def compiled(folder: Path, text: str) -> tuple[Any, list[Finding]]:
    (folder / "robot.yaml").write_text(text)
    made = compile_robot(str(folder / "robot.yaml"), environment={})
    return made.plan, list(made.report)


def test_it_drives_through_the_mux_which_a_person_takes_over_and_silence_stops_the_base(tmp_path: Path) -> None:
    network(tmp_path / "steer.onnx", [[1]], [0])
    plan, findings = compiled(tmp_path, BASE)
    assert [finding.code for finding in findings if finding.severity == "error"] == []
    bench = Bench(plan=plan)
    odometry = bench.collect("/odom", Odometry)

    def speed(wish: float, seconds: float, teleop: float | None = None) -> float:
        for _ in range(round(seconds * 10)):
            bench.publish("/wish", Float32(data=wish))
            if teleop is not None:
                command = Twist()
                bench.publish("/cmd_vel/teleop", command)
            bench.advance(0.1)
        return round(odometry[-1].twist.twist.linear.x, 2)

    assert speed(0.2, 2.0) == 0.2
    assert speed(0.2, 2.0, teleop=0.0) == 0.0
    assert speed(0.2, 2.0) == 0.2
    assert speed(NAN, 2.0) == 0.0
    assert speed(0.2, 2.0) == 0.2
    bench.advance(3.0)
    assert round(odometry[-1].twist.twist.linear.x, 2) == 0.0


def test_it_moves_joints_and_an_empty_trajectory_brings_them_to_rest(tmp_path: Path) -> None:
    path = network(tmp_path / "track.onnx", [[1, 0], [0, 1]], [0.05, -0.05])
    limits = {"least": -1, "most": 1, "jump": 0.1}
    config = {
        "model": str(path),
        "starts": True,
        "observes": [{"topic": "joint_states", "joints": ["pan", "tilt"], "fields": ["position"]}],
        "commands": {"topic": "head/joint_trajectory", "outputs": {"pan": limits, "tilt": limits}},
    }
    bench = Bench(instance("track", "policy", config))
    sent = bench.collect("/head/joint_trajectory", JointTrajectory)
    for _ in range(3):
        bench.publish("/joint_states", JointState(name=("tilt", "pan"), position=np.array([0.5, -0.25])))
        bench.advance(0.1)
    assert sent[0].joint_names == ("pan", "tilt")
    assert [round(value, 3) for value in sent[0].points[0].positions] == [-0.2, 0.45]
    assert sent[0].points[0].time_from_start.nanosec == 200_000_000
    bench.advance(3.0)
    assert [len(one.points) for one in sent].count(0) == 1
    assert not sent[-1].points


def test_joints_that_somebody_else_has_led_away_are_not_jerked_back(tmp_path: Path) -> None:
    path = network(tmp_path / "look.onnx", [[0]], [0.4])  # the same place whatever it sees
    config = {
        "model": str(path),
        "starts": True,
        "observes": [{"topic": "joint_states", "joints": ["pan"], "fields": ["position"]}],
        "commands": {"topic": "stream/policy", "outputs": {"pan": {"least": -1, "most": 1, "jump": 0.1}}},
    }
    bench = Bench(instance("look", "policy", config))
    sent, statuses = bench.collect("/stream/policy", JointTrajectory), bench.statuses("look")

    def at(position: float, seconds: float) -> int:
        """How often it leads the joint while that is at a position."""
        sent.clear()
        for _ in range(round(seconds * 10)):
            bench.publish("/joint_states", JointState(name=("pan",), position=np.array([position])))
            bench.advance(0.1)
        return len([one for one in sent if one.points])

    assert at(0.38, 1.0) > 5
    assert at(0.38 - 0.3, 0.5) > 3, "a joint may be behind"
    assert at(-0.4, 2.0) == 0
    assert (statuses[-1].level, statuses[-1].message) == (Level.ERROR, "'pan' jumps from -0.4 to 0.4, by more than 0.1")
    assert at(0.35, 1.0) > 5


HEAD = """
rbx: 1
kind: Robot
name: head
buses:
  servos: {type: dynamixel, port: /dev/ttyUSB0, baud: 1000000}
include:
  head: {part: "rbx:parts/pan_tilt.yaml", with: {bus: servos, pan_id: 1, tilt_id: 2}}
components:
  turn:
    type: policy
    model: turn.onnx
    starts: true
    observes:
      - {topic: joint_states, joints: [head_pan_joint, head_tilt_joint], fields: [position]}
      - {topic: wish, message: std_msgs/Float32, fields: [data]}
    commands:
      topic: head_controller/joint_trajectory
      outputs:
        head_pan_joint: {least: -1, most: 1, jump: 0.2}
        head_tilt_joint: {least: -0.5, most: 0.5, jump: 0.2}
"""


def test_it_turns_simulated_servos_by_their_controller_which_rest_when_it_is_silent(tmp_path: Path) -> None:
    network(tmp_path / "turn.onnx", [[1, 0], [0, 1], [1, 0]], [0, 0])  # where it is, and by the wish farther
    plan, findings = compiled(tmp_path, HEAD)
    assert [finding for finding in findings if finding.severity == "error"] == []
    bench = Bench(plan=plan)
    states = bench.collect("/joint_states", JointState)

    def pan() -> float:
        return float(states[-1].position[states[-1].name.index("head_pan_joint")])

    bench.advance(1.0)
    start = pan()
    for _ in range(20):
        bench.publish("/wish", Float32(data=0.05))
        bench.advance(0.1)
    assert pan() > start + 0.1
    for _ in range(10):
        bench.publish("/wish", Float32(data=NAN))
        bench.advance(0.1)
    rested = pan()
    bench.advance(2.0)
    assert pan() == pytest.approx(rested, abs=0.005)


def test_check_compares_the_sizes_of_the_network_with_what_is_written(tmp_path: Path) -> None:
    network(tmp_path / "steer.onnx", [[1, 0, 0], [0, 1, 0]], [0, 0, 0])
    _, findings = compiled(tmp_path, BASE)
    found = {(one.message, one.span.line, one.span.column) for one in findings if one.code == "RBX3801" and one.span}
    assert found == {
        ("these are 1 numbers, and 'steer.onnx' takes 2", 11, 15),
        ("these are 1 numbers, and 'steer.onnx' gives 3", 15, 16),
    }


@pytest.mark.parametrize("fields", ["[datum]", "[data.first]"])
def test_nothing_that_follows_from_a_wrong_field_is_reported_beside_it(tmp_path: Path, fields: str) -> None:
    network(tmp_path / "steer.onnx", [[1, 0], [0, 1], [0, 0]], [0, 0])
    text = BASE.replace("fields: [data]", f"fields: {fields}").replace("topic: wish", "topic: battery_level")
    text = text.replace("components:\n", "components:\n  battery: {type: battery_sim, runtime: 5 min}\n")
    _, findings = compiled(tmp_path, text)
    assert [one.code for one in findings if one.severity == "error"] == ["RBX1004"]


def test_check_tells_which_file_is_missing(tmp_path: Path) -> None:
    _, findings = compiled(tmp_path, BASE)
    [found] = [one for one in findings if one.code == "RBX3801"]
    assert found.span is not None
    assert (found.message, found.span.line, found.span.column) == ("there is no file 'steer.onnx'", 9, 12)
