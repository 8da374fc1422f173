"""Files of ArbotiX as they are read: drivers with their joints and controllers, and grippers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, replace
from pathlib import PurePath
from typing import TypeVar

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Report, Span
from rbxcompose.importing.arbotix.controllers import DiffController, FollowController, read_controller
from rbxcompose.importing.arbotix.grippers import ArbotixGripper, read_gripper
from rbxcompose.importing.arbotix.servo_joints import ArbotixJoint, guesses, read_joint
from rbxcompose.importing.foreign_files import ForeignFile, ForeignMap, Given
from rbxcompose.importing.importer import NOT_CARRIED_OVER, OTHER_PROGRAM
from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.manifest.validate import OUT_OF_RANGE

T = TypeVar("T")

USUAL_RATE = 10.0  # [Hz], of reading and of writing, if a file does not say
_FASTEST = 1000.0  # [Hz], of a bus
_MOST_BAUD = 10_000_000
_MAIN = frozenset({"joints", "controllers", "port", "baud"})
_OTHERS = frozenset({"rate", "read_rate", "write_rate", "sync_read", "sync_write", "diagnostic_rate", "timeout", "sim"})
_OF_THE_BOARD = ("digital_servos", "digital_sensors", "analog_sensors")
_KEYS = _MAIN | _OTHERS | frozenset(_OF_THE_BOARD)


@dataclass(frozen=True, slots=True)
class ArbotixDriver:
    """A driver: its line, and what is on it. `idle` are keys that need nothing here; `left_out` names lost joints."""

    port: Given[str] | None = None
    baud: Given[int] | None = None
    rate: Given[float] | None = None
    idle: dict[str, Span] = field(default_factory=dict)
    joints: dict[str, ArbotixJoint] = field(default_factory=dict)
    left_out: set[str] = field(default_factory=set)
    controllers: list[FollowController | DiffController] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class ArbotixFile:
    """What one file has."""

    drivers: list[ArbotixDriver] = field(default_factory=list)
    grippers: list[ArbotixGripper] = field(default_factory=list)


def read_arbotix(file: ForeignFile, report: Report) -> ArbotixFile:
    """Return what a file has, also below the names of programs, as ROS keeps parameters."""
    found = ArbotixFile()
    for name, told, is_gripper in _parts(file, report):
        if not is_gripper:
            found.drivers.append(_driver(told))
        elif (gripper := read_gripper(name, told)) is not None:
            found.grippers.append(gripper)
    return found


def _parts(file: ForeignFile, report: Report) -> Iterator[tuple[str, ForeignMap, bool]]:
    """Yield each driver and gripper of a file by its name, and whether it is a gripper."""
    root = file.root
    if not isinstance(root, MappingNode):
        report.add(OTHER_PROGRAM.at(root.span, f"'{file.name}' is not a file of ArbotiX: it is no map of keys"))
    elif _is_gripper(root):
        yield PurePath(file.name).stem, ForeignMap(root, "the gripper", root.span, report), True
    else:
        yield from _below(file, root, report)


def _below(file: ForeignFile, root: MappingNode, report: Report) -> Iterator[tuple[str, ForeignMap, bool]]:
    named = {name: one for name, one in root.entries.items() if name not in _KEYS and _is_program(one.value)}
    own = replace(root, entries={name: one for name, one in root.entries.items() if name not in named})
    if not named and not _KEYS & own.entries.keys():
        words = f"'{file.name}' is not a file of ArbotiX: it has neither joints nor controllers nor a gripper's model"
        report.add(OTHER_PROGRAM.at(root.span, words))
        return
    if own.entries:
        yield "", ForeignMap(own, "this file", root.span, report), False
    for name, one in named.items():
        if isinstance(one.value, MappingNode):
            yield name, ForeignMap(one.value, f"'{name}'", one.key.span, report), _is_gripper(one.value)


def _is_program(node: TreeNode) -> bool:
    return isinstance(node, MappingNode) and (_is_gripper(node) or bool(_MAIN & node.entries.keys()))


def _is_gripper(node: MappingNode) -> bool:
    return "model" in node and not _MAIN & node.entries.keys()


def _driver(told: ForeignMap) -> ArbotixDriver:
    joints, left_out = _joints(told)
    driver = ArbotixDriver(
        port=told.text("port"),
        baud=told.whole("baud", 1, _MOST_BAUD),
        rate=_rate(told),
        idle=_idle(told),
        joints=joints,
        left_out=left_out,
        controllers=[
            one for name, each in told.maps("controllers", "controller") if (one := read_controller(name, each))
        ],
    )
    for key, span in told.places(*_OF_THE_BOARD).items():
        words = f"'{key}' are not carried over: they are pins of the ArbotiX board, which is not spoken to here"
        told.tell(NOT_CARRIED_OVER.at(span, words))
    told.tell_others()
    return driver


def _joints(told: ForeignMap) -> tuple[dict[str, ArbotixJoint], set[str]]:
    read = {name: read_joint(name, one) for name, one in told.maps("joints", "joint")}
    joints = {name: joint for name, joint in read.items() if joint is not None}
    for span in told.places("joints").values():
        told.report.extend(guesses(joints.values(), span))
    return joints, read.keys() - joints.keys()


def _rate(told: ForeignMap) -> Given[float] | None:
    """Return the larger one of the rates of reading and writing if the file gives one: a bus has one for both."""
    given = [one for key in ("read_rate", "write_rate") if (one := told.above_zero(key)) is not None]
    if not given:
        return None
    rate = max(given, key=lambda one: one.value)
    if rate.value > _FASTEST:
        told.tell(OUT_OF_RANGE.at(rate.span, f"a bus has at most {_FASTEST:g} Hz", help="the rate is left out"))
        return None
    return rate if len(given) == 2 or rate.value >= USUAL_RATE else replace(rate, value=USUAL_RATE)


def _idle(told: ForeignMap) -> dict[str, Span]:
    """Return the places of keys that need nothing here, after checking that they are what they should be."""
    for key in ("rate", "diagnostic_rate", "timeout"):
        told.number(key)
    for key in ("sync_read", "sync_write", "sim"):
        told.flag(key)
    return told.places("rate", "timeout", "sync_write", "sync_read", "diagnostic_rate", "sim")
