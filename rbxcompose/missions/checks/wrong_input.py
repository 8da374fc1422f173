"""Inputs of missions that are used."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.scope_types import View
from rbxcompose.missions.codes import WRONG_INPUT
from rbxcompose.missions.language.argument_types import check_written
from rbxcompose.missions.program.program import Program


@mission_check(WRONG_INPUT)
def wrong_input(mission: Examined) -> Iterator[Finding]:
    """Yield the inputs that the `with` of a `use` gets wrong or leaves out."""
    for view in mission.views:
        used = view.node.step.uses
        program = mission.robot.missions.get(used.text) if used else None
        is_read = all(argument.name for argument in view.node.step.arguments)
        if used and program and is_read:
            yield from _given(view, used.text, program)
            yield from _missing(view, used.text, program)


def _given(view: View, name: str, program: Program) -> Iterator[Finding]:
    inputs = program.inputs
    for argument in view.node.step.arguments:
        if argument.name not in inputs:
            message = f"the mission '{name}' has no input '{argument.name}'"
            yield WRONG_INPUT.misspelt(argument.span, message, argument.name, inputs, "its inputs")
        elif isinstance(argument.value, ScalarNode):
            yield from check_written(view, argument.value, inputs[argument.name].type, WRONG_INPUT)


def _missing(view: View, mission: str, program: Program) -> Iterator[Finding]:
    given = {argument.name for argument in view.node.step.arguments}
    if given - program.inputs.keys():
        return  # the missing input may be the misspelt one
    for name, declared in program.inputs.items():
        if declared.must_be_given and name not in given:
            message = f"the input '{name}' of the mission '{mission}' needs a value"
            yield WRONG_INPUT.at(view.node.span, message, help=f"write it under 'with': '{name}: ...'")
