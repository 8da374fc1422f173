"""An analyzer that matches nothing."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.core import Analyzer
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot


@check("RBX5001", is_fixable=True)
def unmatched_analyzer(robot: Robot) -> Iterator[Finding]:
    """A pattern of an analyzer matches no component

    The group would stay empty, or miss what it was meant to show.

    Bad:
    ```yaml
    diagnostics:
      analyzers:
        power:
          match: [batery]
    ```
    Good:
    ```yaml
    diagnostics:
      analyzers:
        power:
          match: [battery]
    ```
    """
    known = {*robot.components, *robot.written}
    for name, analyzer in robot.manifest.diagnostics.analyzers.items():
        for index, pattern in enumerate(analyzer.match):
            if pattern not in known and not any(Analyzer((pattern,)).matches(component) for component in known):
                yield unmatched_analyzer.misspelt(
                    robot.value("diagnostics", "analyzers", name, "match", index),
                    f"analyzer '{name}' matches no component with '{pattern}'",
                    pattern,
                    known,
                    "components of this robot",
                    taken=analyzer.match,
                )
