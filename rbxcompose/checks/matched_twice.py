"""One component in two groups."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.settings import SHOWN, each_analyzer
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot


@check("RBX5004", Severity.WARNING, closed=())
def matched_twice(robot: Robot) -> Iterator[Finding]:
    """Two analyzers name the same component."""
    first: dict[str, tuple[tuple[str, ...], int]] = {}
    for path, analyzer in each_analyzer(robot.manifest.diagnostics.analyzers):
        shown = analyzer.conditions if analyzer.kind in SHOWN else ()
        for index, pattern in ((index, one) for index, one in enumerate(shown) if isinstance(one, str)):
            other = first.setdefault(pattern, (path, index))
            if other != (path, index):
                yield matched_twice.at(
                    robot.value("diagnostics", "analyzers", *path, "match", index),
                    f"'{pattern}' is matched twice, by analyzer '{other[0][-1]}' and by analyzer '{path[-1]}'",
                    help="remove one of them",
                    related=[
                        Related(robot.value("diagnostics", "analyzers", *other[0], "match", other[1]), "the first")
                    ],
                )
