"""Saved results and outputs."""

from collections.abc import Iterator

from rbxcompose.base.expressions.types import UNKNOWN, accepts, map_of
from rbxcompose.base.findings import OWN, Finding, Related, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.effects import written
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.program.answers import NodeFlow
from rbxcompose.missions.program.program import CONTINUE, MissionNode, Program


@mission_check("RBX4136")
def nothing_to_keep(mission: Examined) -> Iterator[Finding]:
    """A node has no result to keep."""
    for node in mission.program.nodes:
        if node.saved and not node.step.has_result:
            message = f"'{node.step.word}' has no result to keep"
            yield nothing_to_keep.at(node.saved.span, message, help="skills, 'call', 'use' and 'for' have one")


@mission_check("RBX4164", Severity.WARNING, closed=(OWN,))
def read_too_early(mission: Examined) -> Iterator[Finding]:
    """A result is read before it is saved."""
    program = mission.program
    if any(interrupt.afterwards != CONTINUE for interrupt in program.interrupts):
        return  # what is restarted may read what an earlier run of it saved
    savers: dict[str, list[MissionNode]] = {}
    for node in program.nodes:
        if node.saved and node.saved.text not in program.data:
            savers.setdefault(node.saved.text, []).append(node)
    for node in program.nodes if savers else ():
        for asked in node.asked:
            for name in sorted({reference.name for reference in asked.expression.names} & savers.keys()):
                if all(_is_later(program, node, saver) for saver in savers[name]):
                    yield read_too_early.at(
                        asked.scalar.span,
                        f"nothing has saved '{name}' when this is read",
                        help="read it after the step that saves it, or give it a first value under 'data'",
                        related=[
                            Related(mission_node.saved.span, "saved here")
                            for mission_node in savers[name]
                            if mission_node.saved
                        ],
                    )


def _is_later(program: Program, reader: MissionNode, saver: MissionNode) -> bool:
    """Return whether a step surely begins after another one has ended, and neither comes again."""
    before, after = _above(program, reader), _above(program, saver)
    shared = [number for number in before if number in after]
    if not shared or reader.number in after or saver.number in before:
        return False  # in different reactions, or one is within the other
    around = program.nodes[shared[0]]
    if around.step.flow is not NodeFlow.IN_TURN or around.step.goes_on_after != "success":
        return False
    if any(_comes_again(program.nodes[number]) for number in shared):
        return False
    return reader.number < saver.number


def _above(program: Program, node: MissionNode) -> list[int]:
    """Return the numbers of a node and all around it, from the inside out."""
    found, here = [node.number], node.parent
    while here is not None:
        found.append(here)
        here = program.nodes[here].parent
    return found


def _comes_again(node: MissionNode) -> bool:
    return node.step.comes_again or any(modifier.repeats for modifier in node.modifiers.values())


@mission_check("RBX4162")
def saved_over_datum(mission: Examined) -> Iterator[Finding]:
    """A result is kept in a datum of another type."""
    data = mission.program.data
    for node in mission.program.nodes:
        datum = data.get(node.saved.text) if node.saved and node.step.has_result else None
        if node.saved and datum and not accepts(datum.type, map_of(UNKNOWN)):
            name = node.saved.text
            yield saved_over_datum.at(
                node.saved.span,
                f"'{name}' is {datum.type.phrase}, but the result of '{node.step.word}' is a map",
                help=f"write '{name}: {{}}' under 'data', and read an entry of it as '${name}.NAME'; or save it under "
                "another name",
                related=[Related(datum.span, "the datum")],
            )


@mission_check("RBX4134", Severity.WARNING, closed=(OWN,))
def unwritten_output(mission: Examined) -> Iterator[Finding]:
    """An output that nothing writes."""
    program = mission.program
    constant = program.data.keys() - written(program)
    for name, asked in program.outputs.items():
        read = {reference.name for reference in asked.expression.names}
        if read and read <= constant:
            first = sorted(read)[0]
            yield unwritten_output.at(
                asked.scalar.span,
                f"the output '{name}' is always the same: nothing sets '{first}'",
                help=f"set '{first}' where its value is known, or keep a result with 'save: {first}'",
                related=[Related(program.data[first].span, "its only value")],
            )
