"""A mux input whose source does not exist."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from rbxcompose.check_runner import check
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, correction, suggest, surely_meant
from rbxcompose.model.robot import Robot
from rbxcompose.rules import NAMES
from rbxcompose.sdk.ports import Out


@check("RBX3003", is_fixable=True, closed=(NAMES,))
def mux_source(robot: Robot) -> Iterator[Finding]:
    """The `from:` of a mux input names no output."""
    for mux, entry in robot.manifest.muxes.items():
        for name, source in entry.inputs.items():
            if source.source is None:
                continue
            if wrong := missing(robot, source.source) or unclear(robot, mux, source.source):
                span = robot.value("muxes", mux, "inputs", name, "from")
                fix = correction(wrong.name, wrong.valid, span, within=source.source)
                message = f"input '{name}' of mux '{mux}' {wrong.message}"
                yield mux_source.at(span, message, help=wrong.help, fix=fix)


@dataclass(frozen=True, slots=True)
class Wrong:
    """An error in a source: what may help, and the name in it that is not one of `valid`, if any."""

    message: str
    help: str = ""
    name: str = ""
    valid: Collection[str] = ()


def missing(robot: Robot, source: str) -> Wrong | None:
    """Return what is wrong with the source of a mux input; None if it exists."""
    component, _, port = source.partition(".")
    if component not in robot.written:
        message = f"takes from a component that the robot does not have: '{component}'"
        valid = robot.manifest.components
        help_text = suggest(component, valid, "components of this robot")
        if surely_meant(component, set(valid)) is None:
            help_text += "; without 'from' the input is open to the outside"
        return Wrong(message, help_text, component, valid)
    part = robot.components.get(component)
    if part is None:
        return None  # it exists, but has mistakes, which are reported at their own place
    outputs = [end.name for end in part.ends if isinstance(end.port, Out)]
    if port and port not in outputs:
        message = f"takes from an output that '{component}' does not have: '{port}'"
        return Wrong(message, suggest(port, outputs, "its outputs"), port, outputs)
    if not outputs:
        return Wrong(f"takes from '{component}', which publishes nothing")
    return None


def unclear(robot: Robot, mux: str, source: str) -> Wrong | None:
    """Return the error of a source that does not say which of several outputs is meant, None if it is clear."""
    component, _, port = source.partition(".")
    part = robot.components.get(component)
    if part is None or port:
        return None
    outputs = [end for end in part.ends if isinstance(end.port, Out)]
    if len(outputs) == 1 or any(end.port.topic == mux for end in outputs):
        return None
    names = ", ".join(f"{component}.{end.name}" for end in outputs)
    return Wrong(f"takes from '{component}', which publishes nothing on '{mux}'", f"name one of its outputs: {names}")
