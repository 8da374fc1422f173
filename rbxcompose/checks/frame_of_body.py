"""A frame that a component uses and the body does not have."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.body.model import Body
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity, Span, suggest
from rbxcompose.model.flow import is_written, setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.sdk.capabilities import Drives, Setting, WritesFrame
from rbxcompose.sdk.ports import Looks


@check("RBX2019", Severity.WARNING, closed=(WIRING,))
def frame_of_body(robot: Robot) -> Iterator[Finding]:
    """A component uses a frame that the body does not have."""
    description = robot.manifest.body
    if description is None or not description.body.links:
        return
    body = description.body
    placed = {frame for _, one in robot.declared(WritesFrame) for frame in (one.parent.value, one.child.value)}
    placed |= {description.virtual.frame} if description.virtual else set()  # RBX2352
    for component in robot.components.values():
        for frame in component.declared(WritesFrame) if component.declared(Drives) else ():
            if frame.child.value not in body.links:
                message = f"this moves the frame '{frame.child.value}', which the body does not have"
                mover = robot.entry_span(component.name, frame.transforms)
                is_own = is_written(robot, component, frame.child.field)
                place = setting_span(robot, (component, frame.child.field)) if is_own else mover
                yield _finding(body, place, message, _other_root(body, frame.child))
        for port in (end.port for end in component.ends):
            for name in (port.source, port.target) if isinstance(port, Looks) else ():
                if name not in placed and name not in body.links:
                    message = f"'{component.name}' looks up the frame '{name}', which nobody places"
                    help_text = suggest(name, body.links, "its links")
                    yield _finding(body, robot.entry_span(component.name), message, help_text)


def _other_root(body: Body, moved: Setting[str]) -> str:
    *_, section, key = ("", *moved.field.split("."))
    named = f"write '{key}: {body.root}' below '{section}', or " if section and key else ""
    return f"{named}call the root '{moved.value}'"


def _finding(body: Body, place: Span, message: str, help_text: str) -> Finding:
    root = body.links[body.root]
    root_is = [Related(root.span, f"the root of the body is '{root.name}'")]
    return frame_of_body.at(place, message, help=help_text, related=root_is)
