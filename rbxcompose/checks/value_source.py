"""A value whose source does not exist."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.mux_source import Wrong
from rbxcompose.findings import DID_YOU_MEAN, Finding, correction, suggest
from rbxcompose.model.robot import Robot
from rbxcompose.rules import NAMES
from rbxcompose.sdk.ports import In, Out


@check("RBX3005", is_fixable=True, closed=(NAMES,))
def value_source(robot: Robot) -> Iterator[Finding]:
    """A value names no output of a component."""
    for name, entry in robot.manifest.values.items():
        if entry.port is not None and (wrong := _missing(robot, name, entry.port)):
            span = robot.value("values", name, "port")
            fix = correction(wrong.name, wrong.valid, span, within=entry.port)
            yield value_source.at(span, f"value '{name}' {wrong.message}", help=wrong.help, fix=fix)


def _missing(robot: Robot, name: str, source: str) -> Wrong | None:
    component, dot, port = source.partition(".")
    part = robot.components.get(component)
    if part is None:
        if component in robot.written:
            return None  # it exists, but has mistakes, which are reported at their own place
        message = f"comes from a component that the robot does not have: '{component}'"
        outputs = [f"{end.instance}.{end.name}" for end in robot.ends if end.name == component and not port]
        if outputs:
            return Wrong(message, f"{DID_YOU_MEAN} '{outputs[0]}'? It is an output, and needs its component")
        having = [end.instance for end in robot.ends if port and end.name == port and isinstance(end.port, Out)]
        if len(having) == 1:  # the only one with such an output
            return Wrong(message, f"{DID_YOU_MEAN} '{having[0]}.{port}'?", component, having)
        return Wrong(
            message, suggest(component, robot.components, "components of this robot"), component, robot.components
        )
    outputs = [end.name for end in part.ends if isinstance(end.port, Out)]
    taken = part.end(port)
    if taken is not None and isinstance(taken.port, In):
        writers = [f"{end.instance}.{end.name}" for end in robot.writers.get(taken.topic, ())]
        words = f"{DID_YOU_MEAN} '{writers[0]}'?" if writers else suggest(port, outputs, "its outputs")
        return Wrong(f"comes from '{source}', which takes messages, and sends none", words)
    if name in robot.values:
        return None  # the level of a diagnostics group is a value, too
    if not dot:
        message = f"names a component; it must name one of its outputs, as '{component}.PORT'"
        return Wrong(message, suggest("", outputs, "ports"))
    if port not in outputs:
        message = f"comes from an output that '{component}' does not have: '{port}'"
        return Wrong(message, suggest(port, outputs, "its outputs"), port, outputs)
    if name not in robot.values:
        message = "is a whole message; a mission can read only single values"
        return Wrong(message, "write a map with 'topic', 'field', 'type'")
    return None
