"""Transitions to states that do not exist."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.program.machines import MachineStates
from rbxcompose.missions.program.program import MissionNode


@mission_check("RBX4140", is_fixable=True)
def unknown_state(mission: Examined) -> Iterator[Finding]:
    """A transition leads to a state that does not exist."""
    for node in mission.program.nodes:
        if node.step.states:
            yield from _start(node.step.states)
            for child in node.children:
                yield from _targets(mission.program.nodes[child], node.step.states)


def _start(machine: MachineStates) -> Iterator[Finding]:
    if machine.start_span and machine.names and machine.start not in machine.names:
        message, what = f"there is no state '{machine.start}'", "states of this machine"
        yield unknown_state.misspelt(machine.start_span, message, machine.start, machine.names, what)


def _targets(state: MissionNode, machine: MachineStates) -> Iterator[Finding]:
    leads_to = state.step.leads_to
    known = (*machine.names, *machine.ends)
    if leads_to is None:
        return
    for outcome, to in leads_to.to.items():
        if to not in known:
            message = f"there is no state or end '{to}'"
            yield unknown_state.misspelt(leads_to.spans[outcome], message, to, known, "states and ends")
