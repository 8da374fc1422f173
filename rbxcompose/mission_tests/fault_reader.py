"""Reads `fault` of an event: what goes wrong with simulated servos of the robot."""

from __future__ import annotations

from rbxcompose.manifest import test_file as trials
from rbxcompose.manifest.tree import TreeNode, key_span, value_span
from rbxcompose.mission_tests import codes
from rbxcompose.mission_tests.model import EventDeed
from rbxcompose.mission_tests.sections import TrialContext
from rbxcompose.sections.faults import buses_of_joints
from rbxcompose.twins.fault_script import InjectFault
from rbxcompose.twins.servo_faults import FAULTS, UNPLUG

FAULT = "fault"


def read_fault(context: TrialContext, node: TreeNode, model: trials.InjectedModel) -> EventDeed | None:
    """Return the fault as a request to the driver of a bus, None after a finding."""
    driven, report = buses_of_joints(context.robot.manifest.contents), context.report
    words, span = (*FAULTS, UNPLUG), value_span(node, (FAULT, FAULT))
    if model.fault not in words:
        report.add(codes.UNKNOWN.misspelt(span, f"no fault is called '{model.fault}'", model.fault, words, "faults"))
        return None
    if (model.joint is None) == (model.bus is None):
        report.add(codes.NEVER.at(key_span(node, (FAULT,)), "a fault is of one joint, or of one bus"))
        return None
    if model.joint is not None and model.fault == UNPLUG:
        report.add(codes.NEVER.at(span, f"'{model.joint}' cannot be unplugged", help="give 'bus' instead of 'joint'"))
        return None
    known, name, key = (driven, model.joint, "joint") if model.bus is None else (set(driven.values()), model.bus, "bus")
    if name is None or name not in known:
        message = f"no servo drives '{name}'" if key == "joint" else f"no joint is driven by the bus '{name}'"
        what = "joints with a servo" if key == "joint" else "buses of this robot"
        report.add(codes.UNKNOWN.misspelt(value_span(node, (FAULT, key)), message, name or "", known, what))
        return None
    request = InjectFault(model.fault, model.joint or "", model.for_)
    return EventDeed(FAULT, request=request, component=model.bus or driven[name])
