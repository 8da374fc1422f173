"""What the commands `arm` and `scene` share: the robot, the arm and the goal on the command line, and pictures."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from time import perf_counter
from typing import Any, TypeVar

from pydantic import Field

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.config import Angle, Config, Length, Ratio, Speed
from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import Report, clauses, kind, suggest
from rbxcompose.base.units import ANGLE, LENGTH, Dimension
from rbxcompose.commands.console import NotDoneError, misused, refuse, write_report
from rbxcompose.commands.targets import compiled, missing_extras, robot_path
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.domains.arms.motion.arm_task import unknown_joint
from rbxcompose.domains.arms.sections.arms import ArmOfRobot, arms
from rbxcompose.domains.arms.sections.scene import scene
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.meshes import MissingLibraryError
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.servos.sections.joints import JointPosition
from rbxcompose.manifest.fields import FramePose
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import validate

NO_MOTION = kind("RBX2310")
_SHOWN = "GOAL"  # name of a text on the command line in findings
T = TypeVar("T")


def read_written(model: type[T], text: str) -> T:
    """Return a text on the command line as data.

    Raises:
        NotDoneError: if it cannot be read.
    """
    root, findings = read_text(text, _SHOWN)
    report = Report()
    report.extend(findings)
    read = validate(model, root, (), report) if isinstance(root, MappingNode) and not findings else None
    if read is None:
        first = next(iter(report), None)
        raise NotDoneError(NO_MOTION.at(None, first.message if first else f"'{text}' is no map"))
    return read


def keys_of(text: str) -> frozenset[str]:
    """Return the keys of a map on the command line; none if it is something else."""
    root, _ = read_text(text, _SHOWN)
    return frozenset(root.entries) if isinstance(root, MappingNode) else frozenset()


class TracePointModel(FramePose):
    """A point that the tip goes through."""

    via: bool = False
    """Whether it is in the middle of an arc."""


class TraceModel(Config):
    """A way of the tip."""

    points: list[TracePointModel]
    """From where the tip is."""
    frame: str = ""
    """A link; empty is the root."""
    relative: bool = False
    """Whether points are shifts and turns."""
    keep_orientation: bool = False
    """Whether the tip stays turned as it is."""
    any_orientation: bool = False
    """Whether only positions count."""
    speed: Speed = Field(0.0, gt=0)
    """Of the tip."""
    acceleration: Ratio = Field(0.0, gt=0, le=1)
    """Share of the greatest ones."""
    blend: Length = Field(0.0, ge=0)
    """From there on before a corner, the tip cuts it."""
    least: Ratio = Field(0.0, gt=0, le=1)
    """Share of the way that must be possible."""

    def message(self) -> dict[str, Any]:
        """Return it as a goal of `TraceArm`."""
        return self.model_dump()


class KeptJointModel(Config):
    """Where a joint may be."""

    name: str
    """The joint."""
    lower: JointPosition
    """Least position."""
    upper: JointPosition
    """Greatest position."""


class SightModel(Config):
    """What a sensor sees."""

    sensor: str
    """Its link."""
    along: str = ""
    """The axis of its frame along which it looks."""
    target: str = ""
    """The link in whose frame the target is; empty is the root."""
    x: Length = 0.0
    """Of the target."""
    y: Length = 0.0
    """Of the target."""
    z: Length = 0.0
    """Of the target."""
    radius: Length = 0.0
    """Of the disc that is to be seen."""
    angle: Angle = 0.0
    """By which it may be off the axis."""
    through: list[str] = []
    """Links and objects that may be in between."""


class KeepModel(Config):
    """What is kept on the way."""

    roll: Angle = 0.0
    """By which the tip may be turned about x."""
    pitch: Angle = 0.0
    """By which the tip may be turned about y."""
    yaw: Angle = 0.0
    """By which the tip may be turned about z."""
    frame: str = ""
    """A link; empty is the root."""
    x: list[Length] = []
    """From and to."""
    y: list[Length] = []
    """From and to."""
    z: list[Length] = []
    """From and to."""
    joints: list[KeptJointModel] = []
    """Ranges of joints."""
    sight: SightModel | None = None
    """What a sensor sees."""

    def message(self) -> dict[str, Any]:
        """Return it as `PathConstraints`."""
        joints = [{"name": joint.name, "lower": joint.lower.value, "upper": joint.upper.value} for joint in self.joints]
        return {**self.model_dump(exclude_none=True, exclude={"joints"}), "joints": joints}


def chosen_robot(arguments: argparse.Namespace) -> Robot | None:
    """Return the robot; None after its errors."""
    path = robot_path(arguments.path)
    compilation = compiled(path, arguments)
    report = Report()
    report.extend(finding for finding in compilation.report if finding.severity.value == "error")
    if compilation.robot is not None and not report.has_errors and arguments.action != "ls":
        report.extend(missing_extras(compilation.robot))
    write_report(report, compilation.sources)
    return None if report.has_errors else compilation.robot


def with_arm(
    do: Callable[[argparse.Namespace, ArmOfRobot, ArmWorks], int], *, is_fast: bool = False
) -> Callable[[argparse.Namespace], int]:
    """Return what a command does with the chosen arm, and with what plans for it: for many motions if `is_fast`."""

    def run(arguments: argparse.Namespace) -> int:
        if (robot := chosen_robot(arguments)) is None:
            return 1
        found = robot.manifest.contents.of(arms)
        name = arguments.arm or (next(iter(found)) if len(found) == 1 else "")
        if name not in found:
            words = f"there is no arm '{name}'"
            words = clauses(words, suggest(name, found, "arms")) if name else "name one with --arm"
            raise NotDoneError(NO_MOTION.at(None, words if found else "this robot has no arms"))
        config, description = robot.components[name].config, robot.manifest.contents.of(body)
        if not isinstance(config, ArmConfig) or description is None:
            return 1
        return do(arguments, found[name], works_of(robot, config, description, is_fast=is_fast))

    return run


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


def positions_in(works: ArmWorks, robot: ArmOfRobot, written: str) -> dict[str, float]:
    """Return the positions that a goal names [rad or m]: a pose, or '{JOINT: POSITION, ...}'.

    Raises:
        NotDoneError: if it is no goal.
    """
    if not written:
        return {}
    if written in robot.model.poses:
        return {joint: position.value for joint, position in robot.model.poses[written].items()}
    if not written.startswith("{"):
        message = clauses(f"there is no pose '{written}'", suggest(written, robot.model.poses, "poses"))
        raise NotDoneError(NO_MOTION.at(None, message))
    positions = read_joints(written, {joint.name: LENGTH if joint.slides else ANGLE for joint in works.space.joints})
    if unknown := next((name for name in positions if name not in works.space.names), ""):
        raise NotDoneError(NO_MOTION.at(None, unknown_joint(unknown, works.space.names)))
    return positions


def read_joints(written: str, dimensions: Mapping[str, Dimension]) -> dict[str, float]:
    """Return '{JOINT: POSITION, ...}' as positions [rad or m] of joints, of which some measure these dimensions.

    Raises:
        NotDoneError: if it is something else, or a position measures something else.
    """
    try:
        read = read_written(dict[str, JointPosition], written)
    except NotDoneError:
        if unknown := sorted(keys_of(written) - dimensions.keys()):  # which may be why it is no position
            raise NotDoneError(NO_MOTION.at(None, unknown_joint(unknown[0], dimensions))) from None
        raise
    for name, position in read.items():
        if position.dimension != dimensions.get(name, position.dimension):
            word = "slides" if dimensions[name] == LENGTH else "turns"
            raise NotDoneError(NO_MOTION.at(None, f"'{name}' {word}, and this is {position.dimension.phrase}"))
    return {name: position.value for name, position in read.items()}


def values_of(works: ArmWorks, robot: ArmOfRobot, written: str) -> Array:
    """Return all joints at a goal, of shape (n,); those that it does not name are at rest. Raises as `positions_in`."""
    at = positions_in(works, robot, written)
    rest = {name: works.kinematics.body.joints[name].rest for name in works.space.names}
    return np.array([at.get(name, rest[name]) for name in works.space.names])


def shown(works: ArmWorks, solution: Mapping[str, float]) -> str:
    """Return positions of joints for people."""
    return ", ".join(f"{joint.name}: {joint.shown(solution[joint.name])}" for joint in works.space.joints)


def write_picture(verb: str, file: Path, draw: Callable[[], bytes]) -> int:
    """Draw a picture into a file; return the exit code."""
    try:
        replace_file(file.resolve(), draw())
    except MissingLibraryError as error:
        return refuse(error.finding)
    except ValueError as error:
        return misused(verb, str(error))
    except OSError as error:
        return misused(verb, f"'{file}' cannot be written: {error.strerror}")
    return 0


def whole_number(least: int, most: int = 999_999_999) -> Callable[[str], int]:
    """Return a reader of whole numbers within a range, for the type of an option."""

    def read(text: str) -> int:
        if not text.isdecimal() or len(text) > len(str(most)) or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"must be a whole number from {least} to {most}, not '{text}'")
        return int(text)

    return read
