"""One component in two groups."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot


@check("RBX5004", Severity.WARNING, closed=())
def matched_twice(robot: Robot) -> Iterator[Finding]:
    """Two analyzers name the same component

    The component would appear in both groups, and its faults would count twice.

    Bad:
    ```yaml
    diagnostics:
      analyzers:
        power:
          match: [battery, charger]
        motion:
          match: [base, go_to, cmd_vel, battery]
    ```
    Good:
    ```yaml
    diagnostics:
      analyzers:
        power:
          match: [battery, charger]
        motion:
          match: [base, go_to, cmd_vel]
    ```
    """
    first: dict[str, tuple[str, int]] = {}
    for name, analyzer in robot.manifest.diagnostics.analyzers.items():
        for index, pattern in enumerate(analyzer.match):
            other = first.setdefault(pattern, (name, index))
            if other != (name, index):
                yield matched_twice.at(
                    robot.value("diagnostics", "analyzers", name, "match", index),
                    f"'{pattern}' is matched twice, by analyzer '{other[0]}' and by analyzer '{name}'",
                    help="remove one of them",
                    related=[
                        Related(robot.value("diagnostics", "analyzers", other[0], "match", other[1]), "the first")
                    ],
                )
