"""An expected component that does not exist."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.settings import each_analyzer
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot
from rbxcompose.rules import NAMES


@check("RBX5003", is_fixable=True, closed=(NAMES,))
def expected_component(robot: Robot) -> Iterator[Finding]:
    """An analyzer expects a component that the robot does not have."""
    if robot.manifest.diagnostics.profile == "ros1":
        return
    known = {*robot.components, *robot.written, *robot.brought}
    for path, analyzer in each_analyzer(robot.manifest.diagnostics.analyzers):
        for index, expected in enumerate(analyzer.expected):
            if expected.partition(": ")[0] not in known:
                yield expected_component.misspelt(
                    robot.value("diagnostics", "analyzers", *path, "expected", index),
                    f"analyzer '{path[-1]}' expects '{expected}', which the robot does not have",
                    expected,
                    known,
                    "components of this robot",
                )
