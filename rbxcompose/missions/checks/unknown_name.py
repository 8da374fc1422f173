"""Names that are set but do not exist; those that are read are found where their expressions are checked."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, correction, suggest
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.effects import assignments
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.codes import UNKNOWN_NAME


@mission_check(UNKNOWN_NAME)
def unknown_name(mission: Examined) -> Iterator[Finding]:
    """Yield the assignments to data that the mission does not have."""
    data = mission.program.data
    for node in mission.program.nodes:
        set_here = list(assignments(node))
        for assignment in set_here:
            name = assignment.name
            if name not in data and not (mission.program.is_open and name not in mission.program.inputs):
                message = f"only data can be set; the mission has no datum '{name}'"
                if name in mission.program.inputs or name in mission.robot.values:
                    what = "an input" if name in mission.program.inputs else "a value of the robot"
                    help_text = f"'{name}' is {what}, which nobody sets: declare a datum of another name under 'data'"
                    yield UNKNOWN_NAME.at(assignment.span, message, help=help_text)
                    continue
                help_text = suggest(name, data, "its data") or f"write '{name}: ...' under 'data'"
                fix = correction(name, data, assignment.span, taken=[one.name for one in set_here])
                yield UNKNOWN_NAME.at(assignment.span, message, help=help_text, fix=fix)
