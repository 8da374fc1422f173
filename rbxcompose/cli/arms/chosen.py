"""The robot and the arm that a verb of `arm` is about, and positions of joints as its arguments name them."""

from __future__ import annotations

import argparse
from collections.abc import Generator, Mapping
from time import perf_counter
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rbxcompose.arm_config import ArmConfig, ArmWorks
from rbxcompose.body.description import Description
from rbxcompose.cli.arms.written import NO_MOTION, read_written
from rbxcompose.cli.output.console import tell_report
from rbxcompose.cli.project.robot_choice import robot_path
from rbxcompose.cli.project.robot_options import compiled
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.cli.robots.this_machine import missing_extras
from rbxcompose.findings import Report, suggest
from rbxcompose.model.robot import Robot
from rbxcompose.sections.arms import ArmOfRobot, arms
from rbxcompose.sections.joints import JointPosition
from rbxcompose.sections.scene import scene
from rbxcompose.units import ANGLE, LENGTH, Dimension

T = TypeVar("T")


def chosen_robot(arguments: argparse.Namespace) -> Robot | None:
    """Return the robot; None after its errors."""
    path = robot_path(arguments.path)
    if path is None:
        return None
    compilation = compiled(path, arguments)
    report = Report()
    report.extend(one for one in compilation.report if one.severity.value == "error")
    if compilation.robot is not None and not report.has_errors and arguments.action != "ls":
        report.extend(missing_extras(compilation.robot))
    tell_report(report, compilation.sources)
    return None if report.has_errors else compilation.robot


def chosen_arm(arguments: argparse.Namespace, *, is_fast: bool = False) -> tuple[ArmOfRobot, ArmWorks] | None:
    """Return the chosen arm, and what plans for it, for many motions if `is_fast`; None after errors."""
    robot = chosen_robot(arguments)
    if robot is None:
        return None
    found = robot.manifest.contents.of(arms)
    name = arguments.arm or (next(iter(found)) if len(found) == 1 else "")
    if name not in found:
        words = f"there is no arm '{name}'; {suggest(name, found, 'arms')}" if name else "name one with --arm"
        raise NotDoneError(NO_MOTION.at(None, words if found else "this robot has no arms"))
    config, description = robot.components[name].config, robot.manifest.body
    if not isinstance(config, ArmConfig) or description is None:
        return None
    return found[name], works_of(robot, config, description, is_fast=is_fast)


def works_of(robot: Robot, config: ArmConfig, description: Description, *, is_fast: bool) -> ArmWorks:
    """Return what plans for an arm of a robot among the objects of its scene.

    Raises:
        NotDoneError: if a mesh cannot be read.
    """
    things = robot.manifest.contents.of(scene)
    try:
        return ArmWorks(config, perf_counter, things.on(description.body), things.paddings, is_fast=is_fast)
    except ValueError as error:
        raise NotDoneError(NO_MOTION.at(None, str(error))) from error


def positions_in(works: ArmWorks, one: ArmOfRobot, written: str) -> dict[str, float]:
    """Return the positions that a goal names [rad or m]: a pose, or '{JOINT: POSITION, ...}'.

    Raises:
        NotDoneError: if it is no goal.
    """
    if not written:
        return {}
    if written in one.model.poses:
        return {joint: position.value for joint, position in one.model.poses[written].items()}
    if not written.startswith("{"):
        message = f"there is no pose '{written}'; {suggest(written, one.model.poses, 'poses')}"
        raise NotDoneError(NO_MOTION.at(None, message))
    return read_joints(written, {joint.name: LENGTH if joint.slides else ANGLE for joint in works.space.joints})


def read_joints(written: str, dimensions: Mapping[str, Dimension]) -> dict[str, float]:
    """Return '{JOINT: POSITION, ...}' as positions [rad or m] of joints that measure these dimensions.

    Raises:
        NotDoneError: if it is something else, or names another joint.
    """
    read = read_written(dict[str, JointPosition], written)
    for name, position in read.items():
        if name not in dimensions:
            message = f"'{name}' is no joint of this arm; {suggest(name, dimensions, 'joints')}"
            raise NotDoneError(NO_MOTION.at(None, message))
        if position.dimension != dimensions[name]:
            word = "slides" if dimensions[name] == LENGTH else "turns"
            message = f"'{name}' {word}, and this is {position.dimension.phrase}"
            raise NotDoneError(NO_MOTION.at(None, message))
    return {name: position.value for name, position in read.items()}


def values_of(works: ArmWorks, one: ArmOfRobot, written: str) -> NDArray[np.float64]:
    """Return all joints at a goal, of shape (n,); those that it does not name are at rest. Raises as `positions_in`."""
    at = positions_in(works, one, written)
    rest = {name: works.kinematics.body.joints[name].rest for name in works.space.names}
    return np.array([at.get(name, rest[name]) for name in works.space.names])


def shown(works: ArmWorks, solution: Mapping[str, float]) -> str:
    """Return positions of joints for people."""
    return ", ".join(f"{joint.name}: {joint.shown(solution[joint.name])}" for joint in works.space.joints)


def done(work: Generator[None, None, T]) -> T:
    """Return the result of some work."""
    while True:
        try:
            next(work)
        except StopIteration as ended:
            result: T = ended.value
            return result
