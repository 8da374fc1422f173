"""A frame that a component uses and the body does not have."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.body.model import Body
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity, suggest
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.rules import WIRING
from rbxcompose.sdk.capabilities import Drives, WritesFrame
from rbxcompose.sdk.ports import Looks


@check("RBX2019", Severity.WARNING, closed=(WIRING,))
def frame_of_body(robot: Robot) -> Iterator[Finding]:
    """A component uses a frame that the body does not have

    A base moves a frame in `odom`, and everything that the body carries should move with it. If no link has the name of
    that frame, the body stays where it is. A look-up of a frame that nobody places has no answer.

    Bad:
    ```yaml
    body:
      pieces:
        cart:
          urdf: robot.urdf
    ```
    Good:
    ```yaml
    body:
      urdf: robot.urdf
    ```
    """
    description = robot.manifest.body
    if description is None or not description.body.links:
        return
    body = description.body
    placed = {frame for _, one in robot.declared(WritesFrame) for frame in (one.parent.value, one.child.value)}
    for component in robot.components.values():
        for frame in component.declared(WritesFrame) if component.declared(Drives) else ():
            if frame.child.value not in body.links:
                message = f"'{component.name}' moves the frame '{frame.child.value}', which the body does not have"
                yield _finding(robot, body, component, frame.child.value, message)
        for port in (end.port for end in component.ends):
            for name in (port.source, port.target) if isinstance(port, Looks) else ():
                if name not in placed and name not in body.links:
                    message = f"'{component.name}' looks up the frame '{name}', which nobody places"
                    yield _finding(robot, body, component, name, message)


def _finding(robot: Robot, body: Body, component: RobotComponent, frame: str, message: str) -> Finding:
    root = body.links[body.root]
    root_is = [Related(root.span, f"the root of the body is '{root.name}'")]
    help_text = suggest(frame, body.links, "its links")
    return frame_of_body.at(robot.entry_span(component.name), message, help=help_text, related=root_is)
