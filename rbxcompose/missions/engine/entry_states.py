"""Where a mission starts: in the first states of its machines, or in others that a user names."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.missions.program.program import MissionNode, Program


class NoSuchState(LookupError):  # noqa: N818 - shown to whoever names the state
    """Raised with the reason and the existing states."""


def start_at(program: Program, path: str) -> dict[int, str]:
    """Return the initial states of machines, by node number, for a path such as `outer.inner`.

    Each step names a state of a machine; the next step one of a machine inside that state. `program` is linked.

    Raises:
        NoSuchState: if a part names no state.
    """
    found: dict[int, str] = {}
    below = program.main
    for name in path.split("."):
        machines = list(_outermost(program, below))
        if not machines:
            raise NoSuchState(f"'{path}': there is no machine in which '{name}' could be a state")
        matching = [one for one in machines if name in _states(one)]
        if not matching:
            states = ", ".join(state for one in machines for state in _states(one))
            raise NoSuchState(f"there is no state '{name}'; states are {states}")
        machine = matching[0]
        found[machine.number] = name
        below = machine.children[_states(machine).index(name)]
    return found


def _states(machine: MissionNode) -> tuple[str, ...]:
    return machine.step.states.names if machine.step.states else ()


def _outermost(program: Program, number: int) -> Iterator[MissionNode]:
    """Yield the machines of a node and below it, except those inside other machines."""
    node = program.nodes[number]
    if node.step.states:
        yield node
        return
    for child in node.children:
        yield from _outermost(program, child)
