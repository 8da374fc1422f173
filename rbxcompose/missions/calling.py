"""What is written down of a `use`, and what can be wrong with it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbxcompose.findings import Finding, Span
from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions import codes, machine_codes
from rbxcompose.missions.history import WithHistory
from rbxcompose.missions.program import Argument
from rbxcompose.missions.typing import check_written

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.views import View


@dataclass(frozen=True, slots=True)
class UseOptions:
    """The mission that is run, what is given to it, and its history."""

    mission: str
    span: Span
    arguments: tuple[Argument, ...] = ()
    history: str = "none"


def read_use(reader: NodeReader) -> UseOptions:
    """Read the name of the mission, `with` and `history`."""
    name = reader.scalar(reader.key, "the name of a mission")
    given = reader.map_of("with", "a map from inputs to values") if reader.has("with") else None
    entries = given.entries.items() if given else ()
    arguments = tuple(Argument(key, entry.value, entry.key.span) for key, entry in entries)
    return UseOptions(
        name.text if name else "", name.span if name else reader.span, arguments, WithHistory.read_history(reader)
    )


def check_use(view: View) -> Iterator[Finding]:
    """Yield what is wrong with the name or the inputs of a `use`."""
    options, missions = view.node.options, view.robot.missions
    if not isinstance(options, UseOptions) or not options.mission:
        return
    if options.mission not in missions:
        if options.mission not in view.robot.unread:
            message = f"the robot has no mission '{options.mission}'"
            yield machine_codes.UNKNOWN_MISSION.misspelt(
                options.span, message, options.mission, missions, "missions of this robot"
            )
        return
    inputs = missions[options.mission].inputs
    for argument in options.arguments:
        if argument.name not in inputs:
            message = f"the mission '{options.mission}' has no input '{argument.name}'"
            yield codes.WRONG_INPUT.misspelt(argument.span, message, argument.name, inputs, "its inputs")
        elif isinstance(argument.value, Scalar):
            yield from check_written(view, argument.value, inputs[argument.name].type, codes.WRONG_INPUT)
    yield from _missing(view, options)


def _missing(view: View, options: UseOptions) -> Iterator[Finding]:
    given = {argument.name for argument in options.arguments}
    for name, declared in view.robot.missions[options.mission].inputs.items():
        if declared.default is None and name not in given:
            message = f"the input '{name}' of the mission '{options.mission}' needs a value"
            yield codes.WRONG_INPUT.at(view.node.span, message, help=f"write it under 'with': '{name}: ...'")
