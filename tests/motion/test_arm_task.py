"""A goal of an arm from its request to its end, without a bus."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.goals import goal_of
from rbxcompose.domains.arms.motion.arm_task import SETTLING, ArmGoal, ArmTask
from rbxcompose.domains.arms.motion.collisions import MeshChecker, adjacent_pairs
from rbxcompose.domains.arms.motion.inverse_kinematics import PoseTarget, SolverSettings
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.path_constraints import Keep
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.motion.trace_planner import TraceWish, WayPoint
from rbxcompose.domains.arms.reasons import MotionReason
from rbxcompose.domains.body.model import Geometry
from rbxcompose.msgs import rbxcompose_msgs
from tests.loops import for_all
from tests.motion.toy_arm import kinematics, planner

KINEMATICS, PLANNER = kinematics(), planner()
AT = {"turn": 0.8, "lift": 0.0, "bend": 0.2}


class Pushed(dict[str, tuple[float, float]]):
    """An arm that is moved a little whenever somebody looks."""

    def __getitem__(self, name: str) -> tuple[float, float]:
        position, velocity = super().__getitem__(name)
        self[name] = position + 0.05, velocity
        return position, velocity


class Site:
    """What a task needs; `sent` are trajectories that nobody has ended yet."""

    def __init__(self) -> None:
        self.now, self.is_ready, self.problem = 0.0, True, "nothing is known"
        self.measured: dict[str, tuple[float, float]] = {name: (value, 0.0) for name, value in AT.items()}
        self.poses: Mapping[str, Mapping[str, float]] = {"aside": {"turn": 1.2}, "up": {"lift": 1.0, "bend": 0.0}}
        self.sent: list[tuple[Trajectory, Callable[[str, bool], None]]] = []
        self.stops = 0
        self.stages: list[str] = []

    def follow(self, names: tuple[str, ...], trajectory: Trajectory, ended: Callable[[str, bool], None]) -> None:
        self.sent.append((trajectory, ended))

    def stop_following(self) -> None:
        self.stops += 1

    def report_stage(self, stage: str) -> None:
        self.stages.append(stage)

    def info(self, text: str) -> None:
        assert "positions examined" in text or "planned again" in text


def begun(site: Site, goal: ArmGoal) -> ArmTask:
    task = ArmTask(site, KINEMATICS, PLANNER, goal)
    for _ in range(100):
        if task.is_over or site.sent:
            break
        task.advance()
    return task


def test_a_pose_is_planned_and_followed() -> None:
    site = Site()
    task = begun(site, ArmGoal("aside"))
    trajectory, ended = site.sent[0]
    assert trajectory.positions[-1].tolist() == pytest.approx([1.2, 0.0, 0.2])  # what it leaves out stays
    assert not task.is_over
    ended("", False)
    assert (task.is_over, task.failure) == (True, None)
    assert site.stages == ["planning", "moving"]


def test_positions_of_joints_take_precedence_over_the_pose() -> None:
    site = Site()
    begun(site, ArmGoal("up", {"bend": 0.5}))
    assert site.sent[0][0].positions[-1].tolist() == pytest.approx([0.8, 1.0, 0.5])


@for_all(
    "goal, named",
    [
        (ArmGoal("asid"), "there is no pose 'asid'; the poses of this arm: aside, up"),
        (ArmGoal(), "neither a pose nor positions"),
        (ArmGoal("up", {"nose": 1.0}), "'nose' is no joint of this arm; its joints: "),
        (ArmGoal("up", speed=1.5), "not 150%"),
        (ArmGoal("up", acceleration=float("nan")), "acceleration"),
        (ArmGoal(target=PoseTarget(Transform3(), True), prefer="asid"), "there is no pose 'asid'"),
        (ArmGoal(target=PoseTarget(Transform3(), True, any_position=True)), "neither the position nor"),
        (
            ArmGoal(target=PoseTarget(Transform3(), is_approximate=True), keep=Keep((0.1, 0.1, 0.0))),
            "not possible together with 'approximate'",
        ),
    ],
)
def test_a_goal_that_is_none_says_why(goal: ArmGoal, named: str) -> None:
    task = begun(Site(), goal)
    assert task.failure is not None
    assert task.failure.reason is MotionReason.UNKNOWN_GOAL
    assert named in task.failure.text


def test_an_arm_that_nobody_reports_is_waited_for_and_then_given_up() -> None:
    site = Site()
    del site.measured["lift"]
    task = begun(site, ArmGoal("aside"))
    assert not task.is_over
    site.now = SETTLING
    task.advance()
    assert task.failure is not None
    assert task.failure.reason is MotionReason.UNKNOWN_START
    assert "'lift'" in task.failure.text


def test_nothing_is_carried_out_from_elsewhere_than_it_was_planned_from() -> None:
    site = Site()
    site.measured = Pushed(site.measured)
    task = begun(site, ArmGoal("aside"))
    assert not site.sent
    assert task.failure is not None
    assert task.failure.reason is MotionReason.START_MOVED


def test_a_cancelled_motion_ends_when_the_controller_has_stopped() -> None:
    site = Site()
    task = begun(site, ArmGoal("aside"))
    task.cancel()
    task.cancel()
    assert (site.stops, task.is_over) == (1, False)
    site.sent[0][1]("its trajectory was canceled", True)
    assert task.failure is not None
    assert task.failure.reason is MotionReason.INTERRUPTED


@pytest.mark.parametrize(("problem", "is_canceled"), [("path tolerance violated", False), ("", True)])
def test_a_controller_that_fails_is_the_reason(problem: str, is_canceled: bool) -> None:
    site = Site()
    task = begun(site, ArmGoal("aside"))
    site.sent[0][1](problem, is_canceled)
    assert task.failure is not None
    assert task.failure.reason is MotionReason.NOT_FOLLOWED
    assert problem in task.failure.text


def test_the_tip_goes_to_a_target_in_the_frame_of_a_link() -> None:
    site = Site()
    goal = ArmGoal(target=PoseTarget(Transform3((0.1, 0.0, 0.3)), any_orientation=True), frame="fore")
    begun(site, goal)
    before = KINEMATICS.poses(np.array(list(AT.values())))["fore"].apply((0.1, 0.0, 0.3))
    after = KINEMATICS.tip_pose(site.sent[0][0].positions[-1]).translation
    assert after == pytest.approx(before, abs=1e-3)


@pytest.mark.parametrize(
    ("goal", "reason", "named"),
    [
        (PoseTarget(Transform3((9.0, 0.0, 0.0)), True), MotionReason.GOAL_OUT_OF_REACH, "the tip got within 8"),
        (PoseTarget(Transform3((0.45, 0.0, 0.25)), True), MotionReason.GOAL_IN_COLLISION, "'ground'"),
        (PoseTarget(Transform3((math.nan, 0.0, 0.0))), MotionReason.UNKNOWN_GOAL, "not a finite pose"),
    ],
)
def test_a_target_without_a_solution_says_why(goal: PoseTarget, reason: MotionReason, named: str) -> None:
    task = begun(Site(), ArmGoal(target=goal))
    assert task.failure is not None
    assert task.failure.reason is reason
    assert named in task.failure.text


@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["roll", "pitch", "yaw"])
def test_a_goal_with_an_angle_that_is_not_finite_fails(name: str, angle: float) -> None:
    pose: dict[str, Any] = {"x": 0.3, "z": 0.3, name: angle}
    goals = (
        rbxcompose_msgs.ReachPose.Goal(**pose),
        rbxcompose_msgs.TraceArm.Goal(points=(rbxcompose_msgs.TipPoint(**pose),)),
    )
    for goal in goals:
        task = begun(Site(), goal_of(goal))
        assert task.failure is not None
        assert task.failure.reason is MotionReason.UNKNOWN_GOAL


def test_the_nearest_pose_is_taken_only_if_that_is_asked_for_and_tells_what_remains() -> None:
    site, far = Site(), PoseTarget(Transform3((-9.0, 0.0, 0.3)), True, is_approximate=True)
    task = begun(site, ArmGoal(target=far))
    end = KINEMATICS.tip_pose(site.sent[0][0].positions[-1])
    assert task.missed == pytest.approx(far.error(end))
    assert task.missed is not None
    assert task.missed[0] == pytest.approx(9.0 - 0.6 * math.cos(math.pi - 2.0), abs=0.05)  # it turns to 2 rad at most
    near = PoseTarget(KINEMATICS.tip_pose(np.array([1.2, 0.3, 0.3])), True, is_approximate=True)
    assert begun(Site(), ArmGoal(target=near)).missed is None


def test_of_several_solutions_the_one_near_the_preferred_pose_is_taken() -> None:
    target = PoseTarget(KINEMATICS.tip_pose(np.array([1.2, 1.0, 1.0])), True)
    bends = {}
    for goal, solver in (("over", ""), ("under", ""), ("", "over"), ("", "under")):
        site = Site()
        site.poses = {"over": {"bend": 1.0}, "under": {"bend": -1.0}}
        settings = SolverSettings(prefer=solver)
        task = ArmTask(site, KINEMATICS, PLANNER, ArmGoal(target=target, prefer=goal), settings)
        while not site.sent:
            task.advance()
        bends[goal + solver, bool(goal)] = float(site.sent[0][0].positions[-1][2])
    assert bends["over", True] == pytest.approx(1.0, abs=0.02)
    assert bends["under", True] == pytest.approx(-1.0, abs=0.02)
    assert (bends["over", False], bends["under", False]) == (bends["over", True], bends["under", True])


def test_a_motion_stops_for_an_object_that_comes_into_its_way() -> None:
    site, used = Site(), planner()
    task = ArmTask(site, KINEMATICS, used, ArmGoal("up"))
    while not site.sent:
        task.advance()
    at_end = KINEMATICS.tip_pose(site.sent[0][0].positions[-1])
    block = PlacedObject("block", Geometry("box", (0.1, 0.1, 0.1)), "ground", at_end)
    far = replace(block, pose=Transform3((-1.0, 0.0, 1.0)))
    for placed_object, stops in ((far, 0), (block, 1), (block, 1)):
        used.checker = MeshChecker(KINEMATICS, {}, adjacent_pairs(KINEMATICS.body), [placed_object])
        task.look_again()
        assert site.stops == stops
    site.sent[0][1]("its trajectory was canceled", True)
    assert task.failure is not None
    assert task.failure.reason is MotionReason.PATH_IN_COLLISION
    assert "'block'" in task.failure.text


def test_an_arm_whose_velocities_are_noise_is_at_rest_and_one_that_moves_is_not() -> None:
    for speed, is_at_rest in ((0.0, True), (0.3, False)):
        site = Site()
        task = ArmTask(site, KINEMATICS, PLANNER, ArmGoal("aside"))
        for cycle in range(100):
            if task.is_over or site.sent:
                break
            site.now = cycle * 0.05
            site.measured = {name: (value + speed * site.now, 0.6) for name, value in AT.items()}
            task.advance()
        assert bool(site.sent) is is_at_rest
        assert (task.failure is None) is is_at_rest


def test_a_motion_that_something_stops_is_planned_again_as_often_as_was_asked_for() -> None:
    site, used = Site(), planner()
    task = ArmTask(site, KINEMATICS, used, ArmGoal("up", replans=1))
    for times in (1, 2):
        while len(site.sent) < times:
            task.advance()
        trajectory, ended = site.sent[-1]
        middle = KINEMATICS.tip_pose(trajectory.positions[len(trajectory.positions) // 2])
        block = PlacedObject("block", Geometry("box", (0.02, 0.02, 0.02)), "ground", middle)
        used.checker = MeshChecker(KINEMATICS, {}, adjacent_pairs(KINEMATICS.body), [block])
        task.look_again()
        assert site.stops == times
        ended("its trajectory was canceled", True)
    assert task.is_over
    assert task.failure is not None
    assert task.failure.reason is MotionReason.PATH_IN_COLLISION
    assert site.stages == ["planning", "moving", "planning", "moving"]


def test_joints_may_be_elsewhere_within_the_tolerance_if_the_goal_collides() -> None:
    for tolerance, moves in ((0.0, False), (0.3, True)):
        site = Site()
        task = begun(site, ArmGoal(positions={"turn": 0.1}, tolerance=tolerance))
        assert bool(site.sent) is moves
        if moves:
            assert np.max(np.abs(site.sent[0][0].positions[-1] - (0.1, 0.0, 0.2))) <= tolerance
        else:
            assert task.failure is not None
            assert task.failure.reason is MotionReason.GOAL_IN_COLLISION


def test_a_way_of_the_tip_is_planned_and_followed_and_tells_its_share() -> None:
    site = Site()
    way = TraceWish((WayPoint(Transform3((-0.1, 0.0, 0.0))),), relative=True, any_orientation=True)
    task = begun(site, ArmGoal(trace=way))
    before, after = (np.array(KINEMATICS.tip_pose(site.sent[0][0].positions[number]).translation) for number in (0, -1))
    assert np.allclose(after - before, (-0.1, 0.0, 0.0), atol=1e-3)
    assert task.share == 1.0
