"""A value whose source is not there."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.checking import check
from rbxcompose.findings import Finding, suggest
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.ports import Out


@check("RBX3005")
def value_source(robot: Robot) -> Iterator[Finding]:
    """A value names no output of a component

    A value is `component.port`: the newest message of that output. For data from outside the robot, name its topic.

    Bad:
    ```yaml
    values:
      battery: batery.battery_level
    ```
    Good:
    ```yaml
    values:
      battery: battery.battery_level
    ```
    """
    for name, entry in robot.manifest.values.items():
        if entry.port is not None and (wrong := _missing(robot, name, entry.port)):
            message, help_text = wrong
            yield value_source.at(robot.value("values", name), f"value '{name}' {message}", help=help_text)


def _missing(robot: Robot, name: str, source: str) -> tuple[str, str] | None:
    component, dot, port = source.partition(".")
    part = robot.parts.get(component)
    if part is None:
        if component in robot.written:
            return None  # it is there, but broken: that is said at its own place
        known = suggest(component, robot.parts, "components of this robot")
        return f"comes from a component that the robot does not have: '{component}'", known
    outputs = [end.name for end in part.ends if isinstance(end.port, Out)]
    if not dot:
        return f"names a component; it must name one of its outputs, as '{component}.PORT'", suggest(
            "", outputs, "ports"
        )
    if port not in outputs:
        return f"comes from an output that '{component}' does not have: '{port}'", suggest(port, outputs, "its outputs")
    if name not in robot.values:
        return (
            "is a whole message, of which a mission cannot read anything",
            "write a map with 'topic', 'field', 'type'",
        )
    return None
