"""Modifiers without effect."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.facts import Constants, constants_of, number_of, place_in_text
from rbxcompose.missions.program.answers import ModifierScope
from rbxcompose.missions.program.outcomes import FAILS
from rbxcompose.missions.program.program import CONTINUE, MissionNode, Program
from rbxcompose.rules import OWN
from rbxcompose.units import TIME, format_quantity


@mission_check("RBX4127", Severity.WARNING, closed=(OWN,))
def idle_modifier(mission: Examined) -> Iterator[Finding]:
    """A modifier changes nothing."""
    known = constants_of(mission.program, {})
    for node in mission.program.nodes:
        yield from _attempt(node, known)
        yield from _forgiven(mission, node)
        for key, modifier in node.modifiers.items():
            if modifier.serves is ModifierScope.FAILING and not mission.ending.inside_of(node, key).counting_as(FAILS):
                yield idle_modifier.at(
                    place_in_text(node, modifier.value),
                    f"'{key}' changes nothing here: '{node.step.word}' cannot fail",
                    help="it belongs to the step that can fail",
                )
            if modifier.serves is ModifierScope.REPEATED and not _comes_again(mission.program, node):
                yield idle_modifier.at(
                    node.span,
                    f"'{key}' changes nothing here: this step is done only once anyway",
                    help="it belongs to a step inside a loop or a machine",
                )


def _attempt(node: MissionNode, known: Constants) -> Iterator[Finding]:
    """Yield the finding about a limit of each attempt that the limit of all forestalls."""
    each = next((one.attempt_limit for one in node.modifiers.values() if one.attempt_limit), None)
    one, whole = number_of(each, known), number_of(node.limit, known)
    if each is not None and one is not None and whole is not None and one >= whole:
        yield idle_modifier.at(
            place_in_text(node, each),
            f"'attempt_timeout' changes nothing here: all attempts together end after {format_quantity(whole, TIME)}",
            help="'timeout' counts all attempts: make it longer than 'attempt_timeout' times 'attempts'",
        )


def _forgiven(mission: Examined, node: MissionNode) -> Iterator[Finding]:
    """Yield the finding about a condition whose answer nothing takes."""
    is_question = node.step.only_asks and not node.step.waits
    if not is_question or any(one.moments or one.saved for one in node.modifiers.values()):
        return
    for key, modifier in node.modifiers.items():
        turned = mission.ending.inside_of(node, key)
        if modifier.forgives and turned.counting_as(FAILS) and not modifier.changed(turned).counting_as(FAILS):
            yield idle_modifier.at(
                node.span,
                f"'{node.step.word}' decides nothing here: with '{key}', the mission goes on whatever the answer is",
                help=f"remove '{key}', or write 'if' with the steps that it guards below 'then'",
            )


def _comes_again(program: Program, node: MissionNode) -> bool:
    """Return whether anything in the mission can start a node a second time."""
    if any(one.afterwards != CONTINUE for one in program.interrupts):
        return True
    parent = node.parent
    if parent is None:
        return node.number != program.main  # a reaction runs as often as its interrupt
    above = program.nodes[parent]
    is_repeated = above.step.comes_again or any(one.repeats for one in above.modifiers.values())
    return is_repeated or _comes_again(program, above)
