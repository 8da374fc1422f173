"""Modifiers without effect."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.checking import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.facts import never_fails, place_in_text
from rbxcompose.missions.modifiers.limits import Tries
from rbxcompose.model.robot import Robot


@check("RBX4127", Severity.WARNING)
def idle_modifier(robot: Robot) -> Iterator[Finding]:
    """A modifier changes nothing

    `optional` and `attempts` are for steps that can fail. On one that cannot, they probably belong to another step.

    Bad:
    ```yaml
    do:
      - go_to: corner_1
      - wait: 2 s
        optional: true
    ```
    Good:
    ```yaml
    do:
      - go_to: corner_1
        optional: true
      - wait: 2 s
    ```
    """
    for mission in robot.missions.values():
        for node in mission.program.nodes:
            if not never_fails(node) or "timeout" in node.modifiers:
                continue
            for key in ("optional", "attempts"):
                value = node.modifiers.get(key)
                if value:
                    most = value.most if isinstance(value, Tries) else None
                    yield idle_modifier.at(
                        place_in_text(node, most),
                        f"'{key}' changes nothing here: '{node.kind}' cannot fail",
                        help="it belongs to the step that can fail",
                    )
