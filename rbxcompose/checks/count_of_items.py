"""A number of items that no group can have."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.settings import each_analyzer
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot


@check("RBX5012")
def count_of_items(robot: Robot) -> Iterator[Finding]:
    """A group would need more items than it may have."""
    for path, analyzer in each_analyzer(robot.manifest.diagnostics.analyzers):
        least, most = analyzer.counted or (0, None)
        if most is not None and least > most:
            place = ("diagnostics", "analyzers", *path, "count")
            yield count_of_items.at(
                robot.value(*place, "min"),
                f"analyzer '{path[-1]}' needs at least {least} items, but may have no more than {most}",
                related=[Related(robot.value(*place, "max"), "the most")],
                help="swap them",
            )
