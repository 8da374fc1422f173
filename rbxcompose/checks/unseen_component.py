"""A component that no analyzer shows."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.shortened_list import dropped
from rbxcompose.diagnostics.core import Analyzer
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot


@check("RBX5002", Severity.WARNING)
def unseen_component(robot: Robot) -> Iterator[Finding]:
    """A component belongs to no group of the diagnostics

    As soon as there are analyzers, every component that none of them matches goes into the group `Other`, where nobody
    looks for it.

    Bad:
    ```yaml
    components:
      spare:
        type: go_to
        connect:
          go_to: spare
          cmd_vel: cmd_vel/teleop
    ```
    Good:
    ```yaml
    components:
      spare:
        type: go_to
        connect:
          go_to: spare
          cmd_vel: cmd_vel/teleop
    diagnostics:
      analyzers:
        power:
          match: [battery, charger]
        motion:
          match: [base, go_to, spare, cmd_vel]
    ```
    """
    analyzers = robot.manifest.diagnostics.analyzers
    groups = [Analyzer(one.match, one.expected) for one in analyzers.values()]
    seen = {*dropped(robot), *(name for group in groups for name in (*group.match, *group.expected))}
    for name in robot.written - seen if groups else ():
        if name in robot.components and not any(group.matches(name) for group in groups):
            yield unseen_component.at(
                robot.component_span(name),
                f"no analyzer matches '{name}'",
                help=f"put it into the 'match' of one of them: {', '.join(analyzers)}",
            )
