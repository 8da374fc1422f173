"""Inputs of missions that are used."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding
from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions.calling import UseOptions
from rbxcompose.missions.checking import mission_check
from rbxcompose.missions.codes import WRONG_INPUT
from rbxcompose.missions.examined import Examined
from rbxcompose.missions.program import Program
from rbxcompose.missions.typing import check_written
from rbxcompose.missions.views import View


@mission_check(WRONG_INPUT)
def wrong_input(mission: Examined) -> Iterator[Finding]:
    """Yield what `with` of a `use` gives wrongly, or does not give."""
    for view in mission.views:
        options = view.node.options
        program = mission.robot.missions.get(options.mission) if isinstance(options, UseOptions) else None
        if isinstance(options, UseOptions) and program:
            yield from _given(view, options, program)
            yield from _missing(view, options, program)


def _given(view: View, options: UseOptions, program: Program) -> Iterator[Finding]:
    inputs = program.inputs
    for argument in options.arguments:
        if argument.name not in inputs:
            message = f"the mission '{options.mission}' has no input '{argument.name}'"
            yield WRONG_INPUT.misspelt(argument.span, message, argument.name, inputs, "its inputs")
        elif isinstance(argument.value, Scalar):
            yield from check_written(view, argument.value, inputs[argument.name].type, WRONG_INPUT)


def _missing(view: View, options: UseOptions, program: Program) -> Iterator[Finding]:
    given = {argument.name for argument in options.arguments}
    for name, declared in program.inputs.items():
        if declared.default is None and name not in given:
            message = f"the input '{name}' of the mission '{options.mission}' needs a value"
            yield WRONG_INPUT.at(view.node.span, message, help=f"write it under 'with': '{name}: ...'")
