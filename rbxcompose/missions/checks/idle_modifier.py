"""Modifiers without effect."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.checking import mission_check
from rbxcompose.missions.examined import Examined
from rbxcompose.missions.facts import place_in_text
from rbxcompose.missions.in_turn import InTurnOptions
from rbxcompose.missions.modifiers.limits import Tries
from rbxcompose.missions.outcomes import FAILS
from rbxcompose.missions.program import CONTINUE, Node, Program

AGAIN = ("for", "repeat", "machine")  # kinds that do what is in them more than once


@mission_check("RBX4127", Severity.WARNING)
def idle_modifier(mission: Examined) -> Iterator[Finding]:
    """A modifier changes nothing

    `optional` and `attempts` are for steps that can fail. On a step that cannot, they probably belong to another step.
    `once` and `cooldown` are for steps that run repeatedly, in a loop or a machine.

    Bad:
    ```yaml
    do:
      - go_to: corner_1
      - wait: 2 s
        optional: true
    ```
    Good:
    ```yaml
    do:
      - go_to: corner_1
        optional: true
      - wait: 2 s
    ```
    """
    for node in mission.program.nodes:
        for key in ("optional", "attempts"):
            value = node.modifiers.get(key)
            has_timeout = isinstance(value, Tries) and value.timeout is not None
            if value and not has_timeout and not mission.ending.inside_of(node, key).counting_as(FAILS):
                most = value.most if isinstance(value, Tries) else None
                yield idle_modifier.at(
                    place_in_text(node, most),
                    f"'{key}' changes nothing here: {_what(node)} cannot fail",
                    help="it belongs to the step that can fail",
                )
        for key in ("once", "cooldown"):
            if node.modifiers.get(key) and not _comes_again(mission.program, node):
                yield idle_modifier.at(
                    node.span,
                    f"'{key}' changes nothing here: this step is done only once anyway",
                    help="it belongs to a step inside a loop or a machine",
                )


def _what(node: Node) -> str:
    return f"'{node.kind or node.skill}'"


def _comes_again(program: Program, node: Node) -> bool:
    """Tell whether anything in the mission can start a node a second time."""
    if any(one.afterwards != CONTINUE for one in program.interrupts):
        return True
    parent = node.parent
    if parent is None:
        return node.number != program.main  # a reaction comes as often as its interrupt
    above = program.nodes[parent]
    is_reactive = isinstance(above.options, InTurnOptions) and above.options.reactive
    is_anew = "attempts" in above.modifiers or is_reactive
    return above.kind in AGAIN or is_anew or _comes_again(program, above)
