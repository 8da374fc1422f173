"""Arguments of skills."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

from rbxcompose.expressions.types import UNKNOWN, Type, TypeKind
from rbxcompose.findings import Finding, nearest, suggest
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.scope_types import View
from rbxcompose.missions.language.argument_types import check_written
from rbxcompose.missions.language.asked import WrittenArgument
from rbxcompose.missions.language.literals import WrongValue, typed
from rbxcompose.missions.language.written_poses import help_with_place, is_pose, nodes_of
from rbxcompose.missions.modifiers.registry import modifier_keys
from rbxcompose.missions.program.program import Skill
from rbxcompose.printable import plain
from rbxcompose.units import example

PLACED = (TypeKind.PLACE, TypeKind.POSE)
STRUCTURED = (TypeKind.LIST, TypeKind.MAP)


@mission_check("RBX4105", is_fixable=True)
def wrong_argument(mission: Examined) -> Iterator[Finding]:
    """Wrong, missing or unknown argument of a skill."""
    for view in mission.views:
        skill = mission.robot.skills.get(view.node.skill)
        if skill:
            if pose := _written_pose(skill, view.node.step.arguments):
                yield pose
                continue
            for argument in view.node.step.arguments:
                yield from _argument(view, skill, argument)
            yield from _missing(view, skill)


def _written_pose(skill: Skill, arguments: Collection[WrittenArgument]) -> Finding | None:
    """Return the one finding about coordinates in the place of the argument that takes a place."""
    main = skill.arguments.get(skill.main)
    unknown = {one.name: one for one in arguments if one.name not in skill.arguments}
    if main is None or main.kind not in PLACED or len(unknown) != len(arguments) or not is_pose(unknown):
        return None
    message = f"the skill '{skill.name}' takes {main.phrase}, not its coordinates"
    first = next(iter(unknown.values()))
    help_text = help_with_place({name: one.value for name, one in unknown.items()})
    return wrong_argument.at(first.span, message, help=help_text)


def _missing(view: View, skill: Skill) -> Iterator[Finding]:
    given = {argument.name or skill.main for argument in view.node.step.arguments}
    if given - skill.arguments.keys():
        return  # the missing argument may be the misspelt one
    if skill.entries and not given & {*skill.entries.each, skill.main, skill.entries.instead}:
        first, measured = next(iter(skill.entries.each.items()))
        names = ", ".join(filter(None, (skill.main, skill.entries.instead, *skill.entries.each)))
        message = f"the skill '{skill.name}' needs at least one of {names}"
        yield wrong_argument.at(view.node.span, message, help=f"write '{first}: {example(measured)}' below it")
    for name in sorted(skill.required - given):
        message = f"the skill '{skill.name}' needs its argument '{name}'"
        help_text = f"write '{skill.name}: ...'" if name == skill.main else f"write '{name}: ...' below it"
        yield wrong_argument.at(view.node.span, message, help=help_text)


def _one_by_one(view: View, skill: Skill, value: TreeNode) -> str:
    """Return how to do it for each item of a list of words, names or quantities; nothing if that is not meant."""
    items = value.items if isinstance(value, SequenceNode) else ()
    words = [item.text for item in items if isinstance(item, ScalarNode) and not _is_number(item.text)]
    if not words or len(words) != len(items):
        return ""
    if len(words) == 1:
        return f"write '{skill.name}: {plain(words[0], 60)}', without brackets"
    shown = plain(", ".join(words), 60)
    return f"to do it for each: 'for: one', 'in: [{shown}]', 'do: {{{skill.name}: $one}}', each on a line of its own"


def _is_number(text: str) -> bool:
    return text[:1] in "+-.0123456789"


def _argument(view: View, skill: Skill, argument: WrittenArgument) -> Iterator[Finding]:
    name = argument.name or skill.main
    if not name:
        message = f"the skill '{skill.name}' takes no single value"
        none = f"it has no arguments: write '{skill.name}:' with nothing behind it"
        help_text = suggest("", skill.arguments, "its arguments") or none
        yield wrong_argument.at(argument.span, message, help=help_text)
    elif name not in skill.arguments:
        message = f"the skill '{skill.name}' has no argument '{name}'"
        taken = {one.name for one in view.node.step.arguments}
        arguments = skill.arguments
        if name in modifier_keys() and not nearest(name, arguments):
            help_text = f"'{name}' is a setting of the step: move it left, into the column of '{skill.name}'"
            yield wrong_argument.at(argument.span, message, help=help_text)
            return
        finding = wrong_argument.misspelt(argument.span, message, name, arguments, "its arguments", taken=taken)
        if skill.main and skill.main not in taken and "" not in taken and not nearest(name, arguments):
            value = plain(argument.value.text, 60) if isinstance(argument.value, ScalarNode) else "..."
            finding = replace(finding, help=f"{finding.help}; write '{skill.name}: {value}'".removeprefix("; "))
        yield finding
    elif isinstance(argument.value, ScalarNode):
        if argument.value.plain and not argument.value.text:
            yield wrong_argument.at(argument.span, f"the argument '{name}' of '{skill.name}' has no value")
        else:
            yield from check_written(view, argument.value, skill.arguments[name], wrong_argument)
    elif skill.arguments[name].kind in STRUCTURED:
        yield from _inside(argument.value, skill.arguments[name], f"the argument '{name}' of '{skill.name}'")
    else:
        message = f"the argument '{name}' of '{skill.name}' must be {skill.arguments[name].phrase}"
        help_text = _one_by_one(view, skill, argument.value)
        if not help_text and skill.arguments[name].kind in PLACED:
            help_text = help_with_place(nodes_of(argument.value))
        yield wrong_argument.at(argument.span, message, help=help_text)


def _inside(node: TreeNode, wanted: Type, what: str) -> Iterator[Finding]:
    """Yield what is wrong in a list or a map whose entries have types of their own."""
    if wanted.kind is TypeKind.LIST and isinstance(node, SequenceNode):
        for number, item in enumerate(node.items, 1):
            yield from _inside(item, wanted.entry, f"item {number} of {what}")
    elif wanted.parts and isinstance(node, MappingNode):
        for key, entry in node.entries.items():
            if key in wanted.parts:
                yield from _inside(entry.value, wanted.parts[key], f"'{key}' of {what}")
            else:
                message, taken = f"{what} has no entry '{key}'", node.entries
                yield wrong_argument.misspelt(entry.key.span, message, key, wanted.parts, "its entries", taken=taken)
    elif wanted != UNKNOWN:
        try:
            typed(node, wanted)
        except WrongValue as error:
            yield wrong_argument.at(node.span, f"{what} {error.message}", label=error.label, help=error.help)
