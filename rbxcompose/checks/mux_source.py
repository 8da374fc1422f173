"""A mux whose source is not there."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.checking import check
from rbxcompose.findings import Finding, suggest
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.ports import Out


@check("RBX3003")
def mux_source(robot: Robot) -> Iterator[Finding]:
    """The `from:` of a mux input names no output

    `from:` names a component, or `component.port`, that publishes what the mux takes. Without `from:` an input is
    open to the outside.

    Bad:
    ```yaml
    muxes:
      cmd_vel:
        inputs:
          navigation:
            from: goto
            priority: 10
            timeout: 0.5 s
    ```
    Good:
    ```yaml
    muxes:
      cmd_vel:
        inputs:
          navigation:
            from: go_to
            priority: 10
            timeout: 0.5 s
    ```
    """
    for mux, entry in robot.manifest.muxes.items():
        for name, source in entry.inputs.items():
            if source.source is None:
                continue
            finding = missing(robot, source.source)
            if finding:
                message, help_text = finding
                span = robot.value("muxes", mux, "inputs", name, "from")
                yield mux_source.at(span, f"input '{name}' of mux '{mux}' {message}", help=help_text)


def missing(robot: Robot, source: str) -> tuple[str, str] | None:
    """Return what is wrong with the source of a mux input, and what may help; None if it is there."""
    component, _, port = source.partition(".")
    if component not in robot.written:
        return f"takes from a component that the robot does not have: '{component}'", suggest(
            component, robot.manifest.components, "components of this robot"
        )
    part = robot.parts.get(component)
    if part is None:
        return None  # it is there, but broken: that is said at its own place
    outputs = [end.name for end in part.ends if isinstance(end.port, Out)]
    if port and port not in outputs:
        return f"takes from an output that '{component}' does not have: '{port}'", suggest(port, outputs, "its outputs")
    if not outputs:
        return f"takes from '{component}', which publishes nothing", ""
    return None
