"""One frame whose pose two components write."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Related, Severity, Span
from rbxcompose.model.flow import is_written, setting_span
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.model.wires import PortEnd
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.capabilities import WritesFrame

STATIC = "_static"  # suffix of the topic of static transforms; both topics describe one tree


@check("RBX3014", Severity.WARNING, closed=(WIRING, NAMES))
def one_frame_two_writers(robot: Robot) -> Iterator[Finding]:
    """Two components write the pose of the same frame."""
    first: dict[tuple[str, str], FrameWriter] = {}
    for one in sorted(_writers(robot), key=lambda one: one.component.name in robot.written):
        other = first.setdefault((one.end.topic.removesuffix(STATIC), one.frame.child.value), one)
        if other.end is not one.end:
            name = one.component.name
            connection = robot.connection([(one.end, f"{name}/tf")])
            remedy = f", or use another topic: {connection}" if connection else ""
            yield one_frame_two_writers.at(
                one.span(robot),
                f"'{name}' and '{other.component.name}' both write the pose of the frame '{one.frame.child.value}'",
                help=_of_body(robot, one.frame) or f"remove one of them{remedy}",
                related=list(_related(robot, other)),
            )


def _related(robot: Robot, other: FrameWriter) -> Iterator[Related]:
    body = robot.manifest.body
    if other.component.name in robot.written:
        yield Related(other.span(robot), "the other one")
    elif body is not None and body.virtual is not None and other.frame.parent.value == body.body.frame:
        yield Related(body.virtual.frame_span, "the virtual joint")


def _of_body(robot: Robot, written: WritesFrame) -> str:
    """Return what helps if a frame hangs on another one in the body: the root of the body is what moves."""
    body, child = robot.manifest.body.body if robot.manifest.body else None, written.child
    if body is not None and body.frame and child.value == body.own_root:
        moving = f"write 'type: planar' and 'frame: {written.parent.value}' there, or leave it out"
        return f"the virtual joint of the body fixes it in '{body.frame}': {moving}"
    if body is None or child.value not in body.joint_above or not child.field:
        return ""
    above = body.joint_above[child.value].parent
    key = child.field.rpartition(".")[-1]
    return f"it hangs on '{above}' in the body: write '{key}: {body.root}', the root of the body"


@dataclass(frozen=True, slots=True)
class FrameWriter:
    """A component that writes a frame, and the port it uses for that."""

    component: RobotComponent
    frame: WritesFrame
    end: PortEnd

    def span(self, robot: Robot) -> Span:
        """Return the place of the frame's name if it is written, else that of the entry that brings the component."""
        component, field = self.component, self.frame.child.field
        return (
            setting_span(robot, (component, field))
            if is_written(robot, component, field)
            else robot.entry_span(component.name, self.end.name)
        )


def _writers(robot: Robot) -> Iterator[FrameWriter]:
    for component, frame in robot.declared(WritesFrame):
        if end := component.end(frame.transforms):
            yield FrameWriter(component, frame, end)
