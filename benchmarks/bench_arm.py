"""Arms: inverse kinematics of arms that many know, where their descriptions are installed, and planned motions."""

from __future__ import annotations

import time
from collections.abc import Generator
from importlib.metadata import PackageNotFoundError, files
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.measuring import ROOT, Row, Samples
from rbxcompose.arm_config import ArmConfig, ArmWorks
from rbxcompose.body.description import Description
from rbxcompose.body.urdf import read_body
from rbxcompose.body.xml_reader import XmlElement, read_urdf
from rbxcompose.compiler import compile_robot
from rbxcompose.control.limits import MotionLimits
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.groups import chain
from rbxcompose.motion.inverse_kinematics import PoseTarget, solved
from rbxcompose.motion.joint_space import ArmJoint, JointSpace
from rbxcompose.motion.planner import MotionPlan, MotionRequest

TARGETS, MOTIONS, EXACT = 500, 40, 1e-4
ARMS = {
    "Panda": ("panda_description/urdf/panda.urdf", "panda_link0", "panda_hand"),
    "UR5": ("ur_description/urdf/ur5_robot.urdf", "base_link", "tool0"),
    "TIAGo": ("tiago_description/robots/tiago.urdf", "torso_fixed_link", "arm_tool_link"),
}
HOW = f"positions of joints for {TARGETS} poses that it can take, within 0.1 mm and 0.1 mrad, from its rest"
T = TypeVar("T")


def rows() -> list[Row]:
    """Return the figures of arms."""
    return [*(row for name in ARMS for row in _kinematics(name)), *_plans()]


def _kinematics(name: str) -> list[Row]:
    file, base, tip = ARMS[name]
    path = _description(file)
    if path is None:
        return []
    text = path.read_text(encoding="utf-8")
    root = read_urdf(text, file)
    if not isinstance(root, XmlElement):
        raise ValueError(root.message)
    description = Description(text, read_body(root)[0])
    group = chain(description.body, base, tip)
    if group is None:
        raise ValueError(f"{name} has no arm from {base} to {tip}")
    arm, space = ArmKinematics(description, group), JointSpace(tuple(_joint(description, one) for one in group.joints))
    times, found = [], 0
    for seed, goal in enumerate(space.samples(TARGETS, 7)):
        target = PoseTarget(arm.tip_pose(goal), tolerance=EXACT, angle_tolerance=EXACT)
        start = time.process_time()
        solutions = _done(solved(arm, space, target, np.zeros(len(goal)), lambda values: True, seed=seed, enough=1))
        times.append(1000 * (time.process_time() - start))
        found += bool(solutions.free)
    took, what = Samples(tuple(times)), f"inverse kinematics of {name}, {len(space.joints)} joints"
    return [
        Row(what, "ms", HOW, took.median, p99=took.p99, most=1.5),
        Row(f"{what}: solved", "%", HOW, 100 * found / TARGETS, least=99.5),
    ]


def _joint(description: Description, name: str) -> ArmJoint:
    joint = description.body.joints[name]
    if joint.kind == "continuous" or joint.limits is None:
        return ArmJoint(name, MotionLimits(), is_continuous=True)
    return ArmJoint(name, MotionLimits(joint.limits.lower, joint.limits.upper), slides=joint.slides)


def _description(file: str) -> Path | None:
    """Return a file of the package example-robot-data, None without it."""
    try:
        there = files("example-robot-data") or []
    except PackageNotFoundError:
        return None
    return next((Path(str(one.locate())) for one in there if str(one).endswith(file)), None)


def _plans() -> list[Row]:
    robot = compile_robot(str(ROOT / "robots" / "pi_robot"), environment={}).robot
    config = robot.components["right_arm"].config if robot is not None else None
    if not isinstance(config, ArmConfig):
        raise ValueError("robots/pi_robot has no right arm")
    works = ArmWorks(config, time.process_time)
    free = [one for one in works.space.samples(10 * MOTIONS, 3) if works.planner.checker.is_free(one)]
    times, solved_ = [], 0
    for start, goal in pairwise(free[: MOTIONS + 1]):
        begin = time.process_time()
        found = _done(works.planner.plan(MotionRequest(start, goal)))
        times.append(1000 * (time.process_time() - begin))
        solved_ += isinstance(found, MotionPlan)
    took, what = Samples(tuple(times)), "a motion of pi_robot's arm between random positions"
    how = "searched, timed and examined every 0.005 rad on the shapes of the whole body"
    return [
        Row(what, "ms", how, took.median, p99=took.p99, most=150),
        Row(f"{what}: planned", "%", how, 100 * solved_ / (len(free[: MOTIONS + 1]) - 1)),
    ]


def _done(work: Generator[None, None, T]) -> T:
    while True:
        try:
            next(work)
        except StopIteration as ended:
            result: T = ended.value
            return result
