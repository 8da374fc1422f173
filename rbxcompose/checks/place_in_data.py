"""Mission data that name a place that does not exist."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from rbxcompose.check_runner import check
from rbxcompose.expressions.tree import ExpressionError, Variable
from rbxcompose.expressions.types import TypeKind
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Finding, Related, Span, suggest
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, at
from rbxcompose.missions.analysis.effects import replaced, written
from rbxcompose.missions.analysis.facts import Constants
from rbxcompose.missions.language.spans import expression_of
from rbxcompose.missions.program.program import MissionNode, Program
from rbxcompose.model.charge import constants
from rbxcompose.model.robot import Robot


@check("RBX4131", closed=("places",))
def place_in_data(robot: Robot) -> Iterator[Finding]:
    """The data of a mission name a place that the robot does not know."""
    places = robot.manifest.places
    for mission in robot.missions.values():
        program, known = mission.program, {**_shortened(mission.program), **constants(mission)}
        wrong = {name: _without(value, places) for name, value in known.items() if name in program.data}
        for node, name in _goals(robot, program):
            for text, datum in _texts(program, node, name, wrong):
                yield place_in_data.at(
                    _place_of(program, datum, text),
                    f"there is no place '{text}', which '{node.skill}' gets from '${name}'",
                    help=suggest(text, places, "places of this robot"),
                    related=[Related(node.span, "used here")],
                )


def _shortened(program: Program) -> Constants:
    """Return the data that only ever lose items: what remains of them was there from the start."""
    names = (written(program) & program.data.keys()) - replaced(program)
    return {name: program.data[name].value for name in names}


def _without(value: Value, places: Collection[str]) -> Value:
    """Return the texts of a datum that are no places: a list is read once, however many loops are over it."""
    if isinstance(value, list | tuple | dict):
        return [text for text in value if isinstance(text, str) and text not in places]
    return value if isinstance(value, str) and value not in places else None


def _place_of(program: Program, datum: str, text: str) -> Span:
    """Return the place of a text in a datum, or that of the datum's name if the text is not found."""
    match at(program.root, ("data", datum)):
        case MappingNode(entries=entries) if text in entries:
            return entries[text].key.span
        case SequenceNode(items=items):
            spans = (item.span for item in items if isinstance(item, ScalarNode) and item.text == text)
            return next(spans, program.data[datum].span)
        case ScalarNode(span=span):
            return span
    return program.data[datum].span


def _goals(robot: Robot, program: Program) -> Iterator[tuple[MissionNode, str]]:
    """Yield each node whose skill takes a pose from a plain `$name`, with that name."""
    for node in program.nodes:
        skill = robot.skills[node.skill].skill if node.skill in robot.skills else None
        for argument in node.step.arguments if skill else ():
            wanted = skill.arguments.get(argument.name or skill.main) if skill else None
            if wanted is None or wanted.kind is not TypeKind.POSE or not isinstance(argument.value, ScalarNode):
                continue
            try:
                tree = expression_of(argument.value).tree
            except ExpressionError:
                continue
            if isinstance(tree, Variable):
                yield node, tree.name


def _texts(program: Program, node: MissionNode, name: str, known: Constants) -> Iterator[tuple[str, str]]:
    """Yield the texts that `$name` can be at a node, each with the datum that contains it."""
    above = node
    while above.parent is not None:
        above = program.nodes[above.parent]
        if above.item == name:
            items = above.step.items or ()
            listed = items.tree.name if not isinstance(items, tuple) and isinstance(items.tree, Variable) else ""
            found = known.get(listed)
            texts = found if isinstance(found, list | tuple | dict) else ()
            yield from ((text, listed) for text in texts if isinstance(text, str))
            return
    found = known.get(name)
    if isinstance(found, str):
        yield found, name
