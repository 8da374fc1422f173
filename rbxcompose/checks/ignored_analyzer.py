"""An analyzer of type `ignore` under the rules of ROS 1."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.settings import each_analyzer
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot


@check("RBX5014", Severity.WARNING, closed=())
def ignored_analyzer(robot: Robot) -> Iterator[Finding]:
    """What is to be ignored is shown in `Other`

    ROS 1's `IgnoreAnalyzer` matches nothing, so that its items belong to no group and land in `Other`. There, `discard`
    is the type that shows them nowhere.

    Bad:
    ```yaml
    diagnostics:
      profile: ros1
      analyzers:
        noise:
          type: ignore
          match: [charger]
        power:
          match: [battery]
        motion:
          match: [base, go_to, cmd_vel]
    ```
    Good:
    ```yaml
    diagnostics:
      profile: ros1
      analyzers:
        noise:
          type: discard
          match: [charger]
        power:
          match: [battery]
        motion:
          match: [base, go_to, cmd_vel]
    ```
    """
    if robot.manifest.diagnostics.profile != "ros1":
        return
    for path, analyzer in each_analyzer(robot.manifest.diagnostics.analyzers):
        if analyzer.kind == "ignore":
            yield ignored_analyzer.at(
                robot.value("diagnostics", "analyzers", *path, "type"),
                f"what '{path[-1]}' matches lands in 'Other': so it is with the profile 'ros1'",
                help="write 'type: discard', or list it in the section's 'ignore'",
            )
