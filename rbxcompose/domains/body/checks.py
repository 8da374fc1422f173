"""Rules about frames of the body."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import NAMES, WIRING, Finding, Related, Severity, Span, suggest
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.flow import MessageFlow, is_written, setting_span
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotComponent
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.body.sections.body import body
from rbxcompose.sdk.capabilities import Drives, MeasuresIn, Setting, WritesFrame
from rbxcompose.sdk.ports import In, Looks

STATIC = "_static"  # suffix of the topic of static transforms; both topics describe one tree
_TF = ("/tf", f"/tf{STATIC}")


@check("RBX2019", Severity.WARNING, closed=(WIRING,))
def frame_of_body(robot: Robot) -> Iterator[Finding]:
    """A component uses a frame that the body does not have."""
    description = robot.manifest.contents.of(body)
    shape = description.body if description else Body("")
    if description and not shape.links:
        return
    written = [item for _, item in robot.declared(WritesFrame)]
    placed = {item.child.value for item in written} | {item.parent.value for item in written if not item.needs_parent}
    placed |= {description.virtual.frame} if description and description.virtual else set()  # RBX2352
    is_known = description is not None or all(
        robot.components[end.instance].declared(WritesFrame) for topic in _TF for end in robot.writers.get(topic, ())
    )
    for component in robot.components.values():
        for frame in component.declared(WritesFrame) if description and component.declared(Drives) else ():
            if frame.child.value not in shape.links:
                message = f"this moves the frame '{frame.child.value}', which the body does not have"
                mover = robot.entry_span(component.name, frame.transforms)
                is_own = is_written(robot, component, frame.child.field)
                place = setting_span(robot, (component, frame.child.field)) if is_own else mover
                yield _finding(shape, place, message, _other_root(shape, frame.child))
        for port in (end.port for end in component.ends if isinstance(end.port, Looks)):
            named = (port.source, port.target) if description else _mounting(robot, component, port) if is_known else ()
            for name in named:
                if name not in placed and name not in shape.links:
                    message = f"'{component.name}' looks up the frame '{name}', which no component publishes"
                    below = {item.child.value for item in written if item.parent.value == name}
                    known = suggest(name, [*shape.links, *sorted(placed - below)], "known frames")
                    is_mounted = description is None and component.cls.simulated
                    help_text = "write 'frame: base_footprint', or add a 'body' that has it" if is_mounted else known
                    place = robot.value_span_of(component.name, name) or robot.entry_span(component.name)
                    yield _finding(shape, place, message, help_text, (component.name, name))


def _mounting(robot: Robot, component: RobotComponent, port: Looks) -> tuple[str, ...]:
    """Return the frame that a simulated sensor is at, or that a user wrote, unless that is the base itself."""
    is_meant = component.cls.simulated or robot.value_span_of(component.name, port.source) is not None
    return (port.source,) if is_meant and port.source != port.target else ()


def _other_root(body: Body, moved: Setting[str]) -> str:
    *_, section, key = ("", *moved.field.split("."))
    named = f"write '{key}: {body.root}' below '{section}', or " if section and key else ""
    return f"{named}call the root '{moved.value}'"


def _finding(body: Body, place: Span, message: str, help_text: str, about: tuple[str, ...] = ()) -> Finding:
    root = body.links[body.root] if body.links else None
    root_is = [Related(root.span, f"the root of the body is '{root.name}'")] if root else []
    return frame_of_body.at(place, message, help=help_text, related=root_is, about=about)


@check("RBX2026", Severity.WARNING, closed=(WIRING,))
def messages_in_another_frame(robot: Robot) -> Iterator[Finding]:
    """A component takes only messages in a frame, and gets those in another one."""
    flow = MessageFlow(robot)
    for reader, taken in robot.declared(MeasuresIn):
        end = reader.end(taken.port)
        for source in flow.sources(end) if end and isinstance(end.port, In) else ():
            for given in robot.components[source.instance].declared(MeasuresIn):
                if given.port == source.name and given.frame.value != taken.frame.value:
                    yield messages_in_another_frame.at(
                        setting_span(robot, (reader, taken.frame.field)),
                        f"'{reader.name}' takes messages in the frame '{taken.frame.value}', and those of "
                        f"'{source.topic}' are in '{given.frame.value}'",
                        help=f"write '{taken.frame.field}: {given.frame.value}'",
                    )


@check("RBX3014", Severity.WARNING, closed=(WIRING, NAMES))
def one_frame_two_writers(robot: Robot) -> Iterator[Finding]:
    """Two components write the pose of the same frame."""
    first: dict[tuple[str, str], FrameWriter] = {}
    for writer in sorted(_writers(robot), key=lambda frame_writer: frame_writer.component.name in robot.written):
        other = first.setdefault((writer.end.topic.removesuffix(STATIC), writer.frame.child.value), writer)
        if other.end is not writer.end:
            name = writer.component.name
            connection = robot.connection([(writer.end, f"{name}/tf")])
            remedy = f", or use another topic: {connection}" if connection else ""
            yield one_frame_two_writers.at(
                writer.span(robot),
                f"'{name}' and '{other.component.name}' both write the pose of the frame '{writer.frame.child.value}'",
                help=_of_body(robot, writer.frame) or f"remove one of them{remedy}",
                related=list(_related(robot, other)),
            )


def _related(robot: Robot, other: FrameWriter) -> Iterator[Related]:
    description = robot.manifest.contents.of(body)
    if other.component.name in robot.written:
        yield Related(other.span(robot), "the other one")
    elif description and description.virtual and other.frame.parent.value == description.body.frame:
        yield Related(description.virtual.frame_span, "the virtual joint")


def _of_body(robot: Robot, written: WritesFrame) -> str:
    """Return what helps if a frame hangs on another one in the body: the root of the body is what moves."""
    description, child = robot.manifest.contents.of(body), written.child
    if description is None:
        return ""
    shape = description.body
    if shape.frame and child.value == shape.own_root:
        moving = f"write 'type: planar' and 'frame: {written.parent.value}' there, or leave it out"
        return f"the virtual joint of the body fixes it in '{shape.frame}': {moving}"
    if child.value not in shape.joint_above or not child.field:
        return ""
    above = shape.joint_above[child.value].parent
    key = child.field.rpartition(".")[-1]
    return f"it hangs on '{above}' in the body: write '{key}: {shape.root}', the root of the body"


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
