"""States that cannot be reached."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.transitions import reached, transitions
from rbxcompose.rules import OWN


@mission_check("RBX4143", Severity.WARNING, closed=(OWN,))
def unreachable_state(mission: Examined) -> Iterator[Finding]:
    """A state that cannot be reached."""
    for machine, states, leads in transitions(mission.program):
        used = reached(machine.start, leads)
        for state in states if machine.start in leads else ():
            if state.name not in used and state.name not in machine.ends:  # its name is the mistake
                yield unreachable_state.at(state.span, f"no path leads to the state '{state.name}'")
