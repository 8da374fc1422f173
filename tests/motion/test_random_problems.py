"""Random motions among random boxes: what is called a plan passes another examination, the rest has a reason."""

from __future__ import annotations

import math
from collections import Counter
from functools import cache
from random import Random

import numpy as np
import pytest

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.domains.arms.motion.figures import ended, sampled
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionRequest
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason
from rbxcompose.domains.arms.section_models import PlannerModel
from rbxcompose.domains.body.model import Geometry
from tests.motion.toy_arm import Array
from tests.shipped import robot_and_plan
from tests.soak import Soak, rare

QUICK, MANY = 3, 250  # problems for each robot and way of searching
TIME = 0.5  # [s] of a search, counted by the positions that it examines: no clock runs
FINE = 0.005  # [rad]
HAND, SHOULDER = "right_gripper_link", "right_arm_base_link"
POSSIBLE = {
    MotionReason.START_OUTSIDE_LIMITS,
    MotionReason.GOAL_OUTSIDE_LIMITS,
    MotionReason.START_IN_COLLISION,
    MotionReason.GOAL_IN_COLLISION,
    MotionReason.NO_PATH_IN_TIME,
    MotionReason.PATH_IN_COLLISION,
    MotionReason.NO_TIMING,
}


@dataclass(frozen=True, slots=True)
class Problem:
    """Where an arm is, where it should be, of shape (n,), at which share of its speed, and what is around it."""

    start: Array
    goal: Array
    speed: float
    objects: tuple[PlacedObject, ...]


@cache
def works_of(robot: str, is_fast: bool) -> ArmWorks:
    _, plan = robot_and_plan(robot)
    [config] = (instance.config for instance in plan.instances if instance.type == "arm")
    assert isinstance(config, ArmConfig)
    return ArmWorks(config.model_copy(update={"planner": PlannerModel(time=TIME)}), lambda: 0.0, is_fast=is_fast)


def box(chance: Random, name: str, link: str, reach: float) -> PlacedObject:
    """Return a box of random size, somewhere around a link within a distance [m]."""
    sides = tuple(reach * chance.uniform(0.03, 0.4) for _ in range(3))
    away, yaw, up = reach * chance.uniform(0.25, 1.1), chance.uniform(-math.pi, math.pi), chance.uniform(-1.2, 1.2)
    at = (away * math.cos(up) * math.cos(yaw), away * math.cos(up) * math.sin(yaw), away * math.sin(up))
    turn = quaternion_from_rpy(*(chance.uniform(-math.pi, math.pi) for _ in range(3)))
    return PlacedObject(name, Geometry("box", sides), link, Transform3(at, turn))


def problem(works: ArmWorks, seed: int) -> Problem:
    """Return a problem: usually both ends are free, else they are where chance puts them, some beyond the limits."""
    chance, body = Random(seed), works.kinematics.body
    reach = math.dist(*(body.poses({})[link].translation for link in (SHOULDER, HAND)))
    objects = [box(chance, f"box{number}", SHOULDER, reach) for number in range(chance.randrange(8))]
    if chance.random() < 0.2:
        links = [HAND]
        for link in links:
            links.extend(joint.child for joint in body.joints_below[link])
        long = Geometry("box", (0.02, 0.02, chance.uniform(0.05, 0.4)))
        objects.append(
            PlacedObject("held", long, HAND, Transform3((0.08, 0.0, 0.0)), (*links, body.joint_above[HAND].parent))
        )
    works.place_objects(objects)
    samples = works.space.samples(60, seed)
    free = [sample for sample in samples if works.planner.checker.is_free(sample)]
    start, goal = free[:2] if chance.random() < 0.8 and len(free) > 1 else samples[:2]
    if chance.random() < 0.05:
        goal = goal + chance.choice((-1.0, 1.0)) * 4.0
    return Problem(start, goal, chance.uniform(0.1, 1.0), tuple(objects))


def wrong_with(works: ArmWorks, asked: Problem, trajectory: Trajectory) -> str:
    """Return what is wrong with a trajectory, nothing if it may be followed."""
    limits, kinematics = [joint.limits for joint in works.space.joints], works.kinematics
    velocity, acceleration = (
        np.array([math.inf if (most := getattr(limit, name)) is None else most for limit in limits])
        for name in ("velocity", "acceleration")
    )
    points = sampled(trajectory, FINE)
    if not works.second_checker(asked.objects).is_free_along(trajectory, FINE):
        return "it collides"
    if any(works.space.outside(point, 1e-6) for point in points):
        return "it leaves the limits of the joints"
    if trajectory.excess(velocity * asked.speed, acceleration) > 1.0 + 1e-6:
        return "it is too fast"
    ends = [
        math.dist(kinematics.tip_pose(one).apply((1.0, 1.0, 1.0)), kinematics.tip_pose(two).apply((1.0, 1.0, 1.0)))
        for one, two in ((points[0], asked.start), (points[-1], asked.goal))
    ]
    return "" if max(ends) < 1e-6 else "it begins or ends elsewhere"


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("is_fast", [False, True], ids=["by OMPL", "fast"])
@pytest.mark.parametrize("robot", ["porter", *rare("pi_robot")])
def test_what_is_called_a_plan_may_be_followed_and_what_is_none_has_a_reason(
    robot: str, is_fast: bool, soak: Soak
) -> None:
    if is_fast and not soak.is_on:
        pytest.skip("with --soak: it compiles for long")
    works, count = works_of(robot, is_fast), soak.examples(QUICK, MANY)
    wrong: dict[int, str] = {}
    ends: Counter[str] = Counter()
    for seed in range(count):
        asked = problem(works, seed)
        found = ended(works.planner.plan(MotionRequest(asked.start, asked.goal, asked.speed)))
        if isinstance(found, MotionFailure):
            ends[found.reason] += 1
            if found.reason not in POSSIBLE or not found.text:
                wrong[seed] = f"{found.reason}: {found.text}"
            continue
        assert isinstance(found, MotionPlan)
        ends["planned"] += 1
        if found.trajectory is not None and (words := wrong_with(works, asked, found.trajectory)):
            wrong[seed] = words
    note = ", ".join(f"{reason} {number}" for reason, number in sorted(ends.items()))
    soak.tell(f"random motions of {robot} {'by the fast search' if is_fast else 'by OMPL'}", count, len(wrong), note)
    assert not wrong
    assert ends["planned"] > count // 3
