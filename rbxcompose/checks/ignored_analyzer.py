"""An analyzer of type `ignore` under the rules of ROS 1."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.settings import each_analyzer
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot


@check("RBX5014", Severity.WARNING, closed=())
def ignored_analyzer(robot: Robot) -> Iterator[Finding]:
    """What is to be ignored is shown in `Other`."""
    if robot.manifest.diagnostics.profile != "ros1":
        return
    for path, analyzer in each_analyzer(robot.manifest.diagnostics.analyzers):
        if analyzer.kind == "ignore":
            yield ignored_analyzer.at(
                robot.value("diagnostics", "analyzers", *path, "type"),
                f"what '{path[-1]}' matches lands in 'Other': so it is with the profile 'ros1'",
                help="write 'type: discard', or list it in the section's 'ignore'",
            )
