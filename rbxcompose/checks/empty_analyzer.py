"""An analyzer that nothing can belong to."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.settings import each_analyzer
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX5011")
def empty_analyzer(robot: Robot) -> Iterator[Finding]:
    """An analyzer does not say what belongs to it."""
    for path, analyzer in each_analyzer(robot.manifest.diagnostics.analyzers):
        place = robot.key("diagnostics", "analyzers", *path)
        if analyzer.kind == "group" and not analyzer.analyzers:
            help_text = "write 'analyzers:' with the groups below it, or omit 'type: group' and write 'match:'"
            yield empty_analyzer.at(place, f"group '{path[-1]}' has no groups below it", help=help_text)
        elif analyzer.kind not in ("group", "other") and not (
            analyzer.match or analyzer.expected or analyzer.strip_prefix
        ):
            help_text = "write 'match:' with names of components, such as 'match: [battery]'"
            yield empty_analyzer.at(place, f"analyzer '{path[-1]}' matches nothing", help=help_text)
