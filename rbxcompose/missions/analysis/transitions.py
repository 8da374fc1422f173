"""The transitions between the states of machines."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from rbxcompose.missions.program.machines import MachineStates
from rbxcompose.missions.program.program import MissionNode, Program

Leads = Mapping[str, frozenset[str]]  # the states and ends that each state leads to, by its name


def transitions(program: Program) -> Iterator[tuple[MachineStates, list[MissionNode], Leads]]:
    """Yield each machine, its states in the order of the text, and where each leads to."""
    for node in program.nodes:
        if node.step.states:
            states = [program.nodes[child] for child in node.children]
            yield node.step.states, states, {state.name: _targets(state) for state in states}


def reached(start: str, leads: Leads) -> frozenset[str]:
    """Return all states and ends that can be reached from a state, including the state itself."""
    found, open_ones = {start}, [start]
    while open_ones:
        new = leads.get(open_ones.pop(), frozenset()) - found
        found.update(new)
        open_ones.extend(new)
    return frozenset(found)


def leading_to(goals: Iterable[str], leads: Leads) -> frozenset[str]:
    """Return all states and ends from which one of `goals` can be reached, including the goals."""
    back: dict[str, set[str]] = {}
    for name, targets in leads.items():
        for target in targets:
            back.setdefault(target, set()).add(name)
    found = set(goals)
    open_ones = list(found)
    while open_ones:
        new = back.get(open_ones.pop(), set()) - found
        found |= new
        open_ones.extend(new)
    return frozenset(found)


def _targets(state: MissionNode) -> frozenset[str]:
    return frozenset(state.step.leads_to.to.values() if state.step.leads_to else ())
