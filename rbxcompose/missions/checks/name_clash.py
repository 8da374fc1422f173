"""Names with two meanings, where finding them needs the robot."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Related
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.scope_types import View
from rbxcompose.missions.codes import NAME_CLASH
from rbxcompose.missions.engine.condition_watches import POSE
from rbxcompose.missions.program.look import Form
from rbxcompose.missions.program.program import MissionNode, Program, RobotNames
from rbxcompose.missions.program.registry import kinds


@mission_check(NAME_CLASH)
def name_clash(mission: Examined) -> Iterator[Finding]:
    """Yield the inputs, data, nodes, branches and items of loops whose name means something else as well."""
    yield from _declared(mission.program, mission.robot)
    for view in mission.views:
        yield from _of_node(view.node, view.program, view.robot)
        yield from _branches(view.node, view.program, view.robot)
        yield from _item(view)


_OTHER = "choose another name, here and where it is meant"


def _declared(program: Program, robot: RobotNames) -> Iterator[Finding]:
    for section, entries in (("input", program.inputs), ("datum", program.data)):
        for name, entry in entries.items():
            if name in robot.skills:
                yield NAME_CLASH.at(entry.span, f"the {section} '{name}' is named like a skill", help=_OTHER)
            elif name in robot.values or name == POSE:
                yield NAME_CLASH.at(
                    entry.span, f"the {section} '{name}' is named like a value of the robot", help=_OTHER
                )
    for name in program.inputs.keys() & program.data.keys():
        related = [Related(program.inputs[name].span, "the input")]
        yield NAME_CLASH.at(program.data[name].span, f"'{name}' is an input and a datum", related=related)


def _of_node(node: MissionNode, program: Program, robot: RobotNames) -> Iterator[Finding]:
    if node.name in robot.skills and node.step.look.form is not Form.STATE:
        yield NAME_CLASH.at(node.span, f"a node cannot be named like the skill '{node.name}'")
    saved = node.saved
    if saved and (saved.text in robot.values or saved.text in program.inputs):
        yield NAME_CLASH.at(saved.span, f"'{saved.text}' is taken: choose another name for what is kept")


def _branches(node: MissionNode, program: Program, robot: RobotNames) -> Iterator[Finding]:
    names = node.step.branches.names if node.step.branches else ()
    for branch, child in zip(names, node.children, strict=False):
        if branch in kinds() or branch in robot.skills:
            message = f"the branch '{branch}' is named like a kind or a skill"
            yield NAME_CLASH.at(program.nodes[child].span, message)


def _item(view: View) -> Iterator[Finding]:
    item, node = view.node.item, view.node
    if item and item in view.scope.names:
        taken = "a value of the robot has" if item in view.robot.values else "the loop already uses"
        help_text = f"choose another name, such as '{item}_item'"
        yield NAME_CLASH.at(node.span, f"the item '{item}' has a name that {taken}", help=help_text)
    elif item and (item in kinds() or item in view.robot.skills):
        yield NAME_CLASH.at(node.span, f"the item '{item}' is named like a kind or a skill")
