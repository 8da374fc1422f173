"""Names that mean nothing, or two things, to this robot."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from rbxcompose.base import findings
from rbxcompose.base.config import MISSION
from rbxcompose.base.findings import NAMES, WIRING
from rbxcompose.base.printable import plain
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.analysis.examined import Examined, View, mission_check
from rbxcompose.missions.analysis.facts import assignments, called, published
from rbxcompose.missions.codes import NAME_CLASH, UNKNOWN_NAME
from rbxcompose.missions.engine.world import POSE
from rbxcompose.missions.language.grammar import FOREIGN
from rbxcompose.missions.language.node_reader import begun_step, valid_name
from rbxcompose.missions.program.parts import Form, MessageTemplate
from rbxcompose.missions.program.program import MissionNode, Program, RobotNames
from rbxcompose.missions.program.registry import kinds
from rbxcompose.sdk.registry import skill_names


@mission_check(NAME_CLASH)
def name_clash(mission: Examined) -> Iterator[findings.Finding]:
    """Yield the inputs, data, nodes, branches and items of loops whose name means something else as well."""
    yield from _declared(mission.program, mission.robot)
    for view in mission.views:
        yield from _of_node(view.node, view.program, view.robot)
        yield from _branches(view.node, view.program, view.robot)
        yield from _item(view)


_OTHER = "choose another name, here and where it is meant"


def _declared(program: Program, robot: RobotNames) -> Iterator[findings.Finding]:
    for section, entries in (("input", program.inputs), ("datum", program.data)):
        for name, entry in entries.items():
            if name in robot.skills:
                yield NAME_CLASH.at(entry.span, f"the {section} '{name}' is named like a skill", help=_OTHER)
            elif name in robot.values or name == POSE:
                yield NAME_CLASH.at(
                    entry.span, f"the {section} '{name}' is named like a value of the robot", help=_OTHER
                )
    for name in program.inputs.keys() & program.data.keys():
        related = [findings.Related(program.inputs[name].span, "the input")]
        yield NAME_CLASH.at(program.data[name].span, f"'{name}' is an input and a datum", related=related)


def _of_node(node: MissionNode, program: Program, robot: RobotNames) -> Iterator[findings.Finding]:
    if node.name in robot.skills and node.step.look.form is not Form.STATE:
        yield NAME_CLASH.at(node.span, f"a node cannot be named like the skill '{node.name}'")
    saved = node.saved
    if saved and (saved.text in robot.values or saved.text in program.inputs):
        yield NAME_CLASH.at(saved.span, f"'{saved.text}' is taken: choose another name for what is kept")


def _branches(node: MissionNode, program: Program, robot: RobotNames) -> Iterator[findings.Finding]:
    names = node.step.branches.names if node.step.branches else ()
    for branch, child in zip(names, node.children, strict=False):
        if branch in kinds() or branch in robot.skills:
            message = f"the branch '{branch}' is named like a kind or a skill"
            yield NAME_CLASH.at(program.nodes[child].span, message)


def _item(view: View) -> Iterator[findings.Finding]:
    item, node = view.node.item, view.node
    if item and item in view.scope.names:
        taken = "a value of the robot has" if item in view.robot.values else "the loop already uses"
        help_text = f"choose another name, such as '{item}_item'"
        yield NAME_CLASH.at(node.span, f"the item '{item}' has a name that {taken}", help=help_text)
    elif item and (item in kinds() or item in view.robot.skills):
        yield NAME_CLASH.at(node.span, f"the item '{item}' is named like a kind or a skill")


@mission_check("RBX4150", is_fixable=True, closed=(WIRING, NAMES))
def unknown_channel(mission: Examined) -> Iterator[findings.Finding]:
    """A mission uses a topic or a service that the robot does not have."""
    for node in mission.program.nodes:
        for message in published(node):
            yield from _nowhere(message, "topic", mission.robot.topics)
        for message in called(node):
            if (name := message.target.text) in mission.robot.skills and name not in mission.robot.services:
                text = f"'{name}' is a skill, and no service"
                yield unknown_channel.at(message.target.span, text, help=f"write it as a step of its own: '- {name}'")
                continue
            yield from _nowhere(message, "service", mission.robot.services)


def _nowhere(message: MessageTemplate, what: str, known: Mapping[str, str]) -> Iterator[findings.Finding]:
    name = message.target.text
    if name and name not in known:
        text = f"the robot has no {what} '{name}'"
        yield unknown_channel.misspelt(message.target.span, text, name, known, f"{what}s of this robot")


@mission_check("RBX4144", is_fixable=True)
def unknown_mission(mission: Examined) -> Iterator[findings.Finding]:
    """A mission uses another one that the robot does not have."""
    missions = mission.robot.missions
    for node in mission.program.nodes:
        used = node.step.uses
        name = used.text if used else ""
        known = name in missions or name in mission.robot.unread or mission.robot.may_have(MISSION, name)
        if used and name and not known:
            message = f"the robot has no mission '{name}'"
            found = unknown_mission.misspelt(used.span, message, name, missions, "missions of this robot")
            listed = f"list it under 'missions' of the robot, '{plain(name, 60)}: FILE', or use one of them"
            is_near = found.help.startswith(findings.DID_YOU_MEAN)
            yield (
                found
                if is_near
                else replace(found, help=f"{listed}: {', '.join(list(missions)[: findings.MOST_NAMES])}")
            )


@mission_check(UNKNOWN_NAME)
def unknown_name(mission: Examined) -> Iterator[findings.Finding]:
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
                    help_text = f"'{name}' is {what}, which is never set: declare a datum of another name under 'data'"
                    yield UNKNOWN_NAME.at(assignment.span, message, help=help_text)
                    continue
                help_text = findings.suggest(name, data, "its data") or f"write '{name}: ...' under 'data'"
                fix = findings.correction(name, data, assignment.span, taken=[one.name for one in set_here])
                yield UNKNOWN_NAME.at(assignment.span, message, help=help_text, fix=fix)


_WORD = re.compile(r"[a-zA-Z_].*")


def _called(node: MissionNode) -> str:
    """Return the word after a step, as in 'service: go_to'."""
    words = (argument.value.text for argument in node.step.arguments if isinstance(argument.value, ScalarNode))
    return next(words, "")


def _channel(name: str, robot: RobotNames) -> str:
    """Return how a mission uses a service or a topic of the robot; empty for another name."""
    if name in robot.services:
        return f"it is a service: write 'call: {name}', and below it 'request: ...' if it takes one"
    return f"it is a topic: write 'publish: {name}', and below it 'message: ...'" if name in robot.topics else ""


@mission_check("RBX4102", is_fixable=True)
def unknown_skill(mission: Examined) -> Iterator[findings.Finding]:
    """A mission uses a skill that the robot does not have."""
    skills = mission.robot.skills
    for node in mission.program.nodes:
        if node.skill and node.skill not in skills:
            known = (*skills, *skill_names(), *kinds())
            close = findings.nearest(node.skill, known)
            # Else it may belong to a component that could not be read.
            ours = FOREIGN.get(node.skill.casefold(), "")
            if mission.robot.is_complete or ours or findings.surely_meant(node.skill, known):
                message = f"mission '{mission.program.name}' uses a skill that the robot does not have: '{node.skill}'"
                if channel := _channel(node.skill, mission.robot):
                    yield unknown_skill.at(node.span, message, help=channel, about=[node.skill])
                    continue
                if not _WORD.fullmatch(node.skill):
                    message = f"'{node.skill}' is no step"
                    yield unknown_skill.at(
                        node.span, message, help="write a step, or a list of steps, such as '- go_to: dock'"
                    )
                    continue
                if (called := _called(node)) in skills:
                    is_plain = f"a step is the name of its skill: '- {called}: ...'"
                    help_text = f"{is_plain}, with its arguments after the colon"
                    yield unknown_skill.at(node.span, message, help=help_text, about=[node.skill])
                    continue
                spoken, rest = begun_step([node.skill, *_called(node).split()], (), skills)
                if spoken in skills and spoken != valid_name(node.skill):  # its name ends behind the colon
                    help_text = f"write '{' '.join([f'{spoken}:', *rest])}'"
                    yield unknown_skill.at(node.span, message, help=help_text, about=[node.skill])
                    continue
                if ours in kinds():
                    # what is below it may differ
                    fix = findings.replacement(node.span, node.skill, ours, is_safe=False)
                    help_text = f"{findings.DID_YOU_MEAN} '{ours}'?"
                    yield unknown_skill.at(node.span, message, help=help_text, fix=fix, about=[node.skill])
                    continue
                owner, is_other, own = node.skill.rpartition("/")
                if is_other and not close:
                    help_text = (
                        f"a robot '{owner}' of the system must share '{own}', and name this robot below 'callers'; "
                        "if the type is one of its 'msgs', this robot needs that, too"
                    )
                    yield unknown_skill.at(node.span, message, help=help_text)
                    continue
                valid = known if close else skills
                yield unknown_skill.misspelt(node.span, message, node.skill, valid, "skills of this robot")
