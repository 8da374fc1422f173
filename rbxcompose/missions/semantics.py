"""What can be known of a mission on a robot before it runs: names, types, arguments, loops that never wait."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.types import TypeKind
from rbxcompose.findings import Finding, Related, nearest
from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions import codes
from rbxcompose.missions.kinds.parallel import ParallelOptions
from rbxcompose.missions.machines import STATE
from rbxcompose.missions.modifiers.registry import modifiers
from rbxcompose.missions.program import END, ROOT, Argument, Program, RobotNames, Skill
from rbxcompose.missions.registry import all_kinds, kinds
from rbxcompose.missions.typing import check_written
from rbxcompose.missions.views import View, base_scope, findings_of, views
from rbxcompose.missions.watching import POSE

STRUCTURED = (TypeKind.LIST, TypeKind.MAP)


def check_program(program: Program, robot: RobotNames) -> Iterator[Finding]:
    """Yield all that is wrong with a mission on this robot, each with its place."""
    yield from _clashes(program, robot)
    for view in views(program, robot):
        node = view.node
        for asked in (one for one in node.asked if not one.is_assigned):
            yield from view.typed(asked.expression, asked.wanted, asked.scalar, codes.WRONG_TYPE)
        if node.kind:
            yield from all_kinds()[node.kind].task.check(view)
        elif node.skill:
            yield from _skill(view)
        for key in node.modifiers:
            yield from modifiers()[key].check(view)
        if node.item:
            yield from _item_clash(view)
    scope = base_scope(program, robot)
    for interrupt in program.interrupts:
        when = interrupt.when
        yield from findings_of(when.expression, when.wanted, when.scalar, scope, codes.WRONG_TYPE)
    for asked in program.outputs.values():
        yield from findings_of(asked.expression, asked.wanted, asked.scalar, scope, codes.WRONG_TYPE)
    yield from _not_restartable(program, robot)


def _clashes(program: Program, robot: RobotNames) -> Iterator[Finding]:
    """Yield the names of inputs and data that mean something else as well."""
    for section, entries in (("input", program.inputs), ("datum", program.data)):
        for name, entry in entries.items():
            if name in robot.skills:
                yield codes.NAME_CLASH.at(entry.span, f"the {section} '{name}' is named like a skill")
            elif name in robot.values or name == POSE:
                yield codes.NAME_CLASH.at(entry.span, f"the {section} '{name}' is named like a value of the robot")
    for name in program.inputs.keys() & program.data.keys():
        related = [Related(program.inputs[name].span, "the input")]
        yield codes.NAME_CLASH.at(program.data[name].span, f"'{name}' is an input and a datum", related=related)
    for node in program.nodes:
        if node.name in robot.skills and node.kind != STATE:
            yield codes.NAME_CLASH.at(node.span, f"a node cannot be named like the skill '{node.name}'")
        saved = node.modifiers.get("save")
        if isinstance(saved, Scalar) and (saved.text in robot.values or saved.text in program.inputs):
            yield codes.NAME_CLASH.at(saved.span, f"'{saved.text}' is taken: choose another name for what is kept")
        if isinstance(node.options, ParallelOptions):
            for branch, child in zip(node.options.branches, node.children, strict=False):
                if branch in kinds() or branch in robot.skills:
                    message = f"the branch '{branch}' is named like a kind or a skill"
                    yield codes.NAME_CLASH.at(program.nodes[child].span, message)


def _item_clash(view: View) -> Iterator[Finding]:
    item, node = view.node.item, view.node
    if item in view.scope.names:
        yield codes.NAME_CLASH.at(node.span, f"the item '{item}' has the name of something that the loop sees already")
    elif item in kinds() or item in view.robot.skills:
        yield codes.NAME_CLASH.at(node.span, f"the item '{item}' is named like a kind or a skill")


def _skill(view: View) -> Iterator[Finding]:
    node, skills = view.node, view.robot.skills
    if node.skill not in skills:
        message = f"mission '{view.program.name}' uses a skill that nobody provides: '{node.skill}'"
        close = nearest(node.skill, (*skills, *kinds()))
        if close or view.robot.is_complete:
            known = (*skills, *kinds()) if close else skills
            yield codes.UNKNOWN_SKILL.misspelt(node.span, message, node.skill, known, "skills of this robot")
        return
    skill = skills[node.skill]
    given = {argument.name or skill.main for argument in node.arguments}
    for argument in node.arguments:
        yield from _argument(view, skill, argument)
    if given - skill.arguments.keys():
        return  # what seems to be missing may be what is misspelt
    for name in sorted(skill.required - given):
        message = f"the skill '{skill.name}' needs its argument '{name}'"
        help_text = f"write '{skill.name}: ...'" if name == skill.main else f"write '{name}: ...' below it"
        yield codes.WRONG_ARGUMENT.at(node.span, message, help=help_text)


def _argument(view: View, skill: Skill, argument: Argument) -> Iterator[Finding]:
    name = argument.name or skill.main
    if not name:
        yield codes.WRONG_ARGUMENT.at(argument.span, f"the skill '{skill.name}' takes no single value")
    elif name not in skill.arguments:
        message = f"the skill '{skill.name}' has no argument '{name}'"
        taken = {one.name for one in view.node.arguments}
        arguments = skill.arguments
        yield codes.WRONG_ARGUMENT.misspelt(argument.span, message, name, arguments, "its arguments", taken=taken)
    elif isinstance(argument.value, Scalar):
        if argument.value.plain and not argument.value.text:
            yield codes.WRONG_ARGUMENT.at(argument.span, f"the argument '{name}' of '{skill.name}' has no value")
        else:
            yield from check_written(view, argument.value, skill.arguments[name], codes.WRONG_ARGUMENT)
    elif skill.arguments[name].kind not in STRUCTURED:
        message = f"the argument '{name}' of '{skill.name}' must be {skill.arguments[name].phrase}"
        yield codes.WRONG_ARGUMENT.at(argument.span, message)


def _not_restartable(program: Program, robot: RobotNames) -> Iterator[Finding]:
    """Yield the skills of the mission proper that an interrupt may start again although that does them no good."""
    cutting = [one for one in program.interrupts if one.afterwards != END]
    if not cutting:
        return
    for node in program.below(ROOT):
        skill = robot.skills.get(node.skill)
        if skill and not skill.restartable and not skill.pausable:
            related = [Related(cutting[0].span, "this may cut it short")]
            afterwards = cutting[0].afterwards
            message = f"the skill '{skill.name}' cannot be restarted, but 'afterwards: {afterwards}' would do so"
            yield codes.NOT_RESTARTABLE.at(node.span, message, related=related)
