"""Steps that are never reached."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from rbxcompose.checking import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.facts import never_fails, starts_always
from rbxcompose.missions.in_turn import RANDOM, InTurnOptions
from rbxcompose.missions.outcomes import SUCCEEDS, Ending
from rbxcompose.missions.program import Node, Program
from rbxcompose.model.robot import Robot


@check("RBX4125", Severity.WARNING)
def after_forever(robot: Robot) -> Iterator[Finding]:
    """A step is never reached

    A sequence goes on after a step that succeeds, a fallback after one that fails. What is repeated for ever does not
    succeed, and what cannot fail is never followed by a second choice.

    Bad:
    ```yaml
    do:
      - repeat: forever
        do:
          go_to: corner_1
      - go_to: dock
    ```
    Good:
    ```yaml
    do:
      - repeat: 3
        do:
          go_to: corner_1
      - go_to: dock
    ```
    """
    for mission in robot.missions.values():
        ending = Ending(mission.program, robot.names)
        for node in mission.program.nodes:
            if node.kind in ("sequence", "fallback") and (found := _barrier(mission.program, node, ending)):
                barrier, following, why = found
                yield after_forever.at(
                    following.span,
                    f"this step is never reached: the one before it {why}",
                    related=[Related(barrier.span, "this one")],
                )


def _barrier(program: Program, node: Node, ending: Ending) -> tuple[Node, Node, str] | None:
    """Return the first step that none can follow, the step behind it, and why."""
    if isinstance(node.options, InTurnOptions) and node.options.order == RANDOM:
        return None
    steps = [program.nodes[child] for child in node.children]
    for step, following in pairwise(steps):
        if node.kind == "sequence" and not ending.of(step.number).counting_as(SUCCEEDS):
            return step, following, "never ends in success"
        if node.kind == "fallback" and _holds_on(step):
            return step, following, "never fails"
    return None


def _holds_on(step: Node) -> bool:
    """Tell whether a step always ends in success, so that it is not skipped either."""
    if not starts_always(step):
        return False
    is_optional = bool(step.modifiers.get("optional")) and bool(step.skill)
    return is_optional or (never_fails(step) and "timeout" not in step.modifiers)
