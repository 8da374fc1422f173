"""Shared means for reading the sections of a test."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.types import UNKNOWN, Type
from rbxcompose.findings import Report
from rbxcompose.manifest.tree import Entry, MappingNode, TreeNode
from rbxcompose.mission_tests import codes
from rbxcompose.mission_tests.mission_facts import MissionFacts
from rbxcompose.mission_tests.model import ValueSetting
from rbxcompose.mission_tests.scope import check_setting, names_of, setting_of
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.model.robot import Robot


@dataclass(frozen=True, slots=True)
class TrialContext:
    """The robot and the mission of a test, what is known about them, and the report for findings."""

    robot: Robot
    program: Program
    names: RobotNames
    facts: MissionFacts
    report: Report

    def settings(self, node: TreeNode | None, known: Mapping[str, Type]) -> dict[str, ValueSetting]:
        """Return the settings by name; besides the robot's values, expressions see what is `known`."""
        found: dict[str, ValueSetting] = {}
        valid = names_of(self.names)
        for name, entry in entries_of(node):
            if name not in valid:
                message = f"the robot has no value '{name}'"
                self.report.add(codes.UNKNOWN.misspelt(entry.key.span, message, name, valid, "values of this robot"))
                continue
            inputs = {key: one.type for key, one in self.program.inputs.items()}
            findings = list(check_setting(entry.value, valid[name], self.program, self.names, {**inputs, **known}))
            self.report.extend(findings)
            if not findings:
                found[name] = setting_of(entry.value, valid[name], self.names)
        return found

    def type_of_datum(self, name: str) -> Type | None:
        """Return the type of a datum of the mission, None if it does not exist."""
        if name in self.program.data:
            return self.program.data[name].type
        return UNKNOWN if name in self.program.saved else None


def entries_of(node: TreeNode | None) -> Iterator[tuple[str, Entry]]:
    """Yield the entries of a map; nothing for any other node, which has its finding already."""
    if isinstance(node, MappingNode):
        yield from node.entries.items()
