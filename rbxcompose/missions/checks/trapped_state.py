"""States without a way out."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.transitions import leading_to, reached, transitions
from rbxcompose.missions.program.program import MissionNode
from rbxcompose.rules import OWN


@mission_check("RBX4133", Severity.WARNING, closed=(OWN,))
def trapped_state(mission: Examined) -> Iterator[Finding]:
    """A state from which no path leads to an end."""
    for machine, states, leads in transitions(mission.program):
        used = reached(machine.start, leads)
        goals = {*machine.ends, *(state.name for state in states if _is_endless(state))}
        if not used & machine.ends.keys():
            continue  # it is meant to run for ever
        free = leading_to(goals, leads)
        for state in states:
            if state.name in used and state.name not in free:
                yield trapped_state.at(
                    state.span,
                    f"no path leads from the state '{state.name}' to an end",
                    help="let one of its outcomes, or of the states after it, lead back or to an end",
                )


def _is_endless(state: MissionNode) -> bool:
    return state.step.leads_to is None
