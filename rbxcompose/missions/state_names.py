"""States whose names are none: each is read under the name that was meant, so that it is told once and nothing else."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

from rbxcompose.findings import Edit, Finding, Fix, nearest
from rbxcompose.manifest.tree import Entry, Node, Scalar
from rbxcompose.manifest.tree import Mapping as Tree
from rbxcompose.missions.machines import ENDS
from rbxcompose.missions.naming import NAME, cure, no_name


def with_names(machine: Tree) -> tuple[Tree, list[Finding]]:
    """Return the map below `machine` with names for all states, and the findings about those that had none."""
    states = machine.get("states")
    wrong = [name for name in states.entries if not NAME.fullmatch(name)] if isinstance(states, Tree) else []
    if not isinstance(states, Tree) or not wrong:
        return machine, []
    cures = {name: cure(name) for name in wrong}
    meant = {name: new for name, new in cures.items() if new and _is_free(new, states.entries, cures)}
    findings = []
    for name in wrong:
        key = states.entries[name].key
        places = [key.span, *(one.span for one in _ways(machine, states) if one.text == name)]
        edits = tuple(Edit(place, name, meant[name]) for place in places) if name in meant else ()
        fix = Fix(edits, True, f"'{name}' -> '{meant[name]}'") if edits else None
        findings.append(no_name(key, fix))
    ends = machine.get("ends")
    known = {*states.entries, *ENDS, *(ends.entries if isinstance(ends, Tree) else ())}
    return _renamed(machine, states, _Meant(meant, known)), findings


def _is_free(name: str, states: Collection[str], cures: Mapping[str, str]) -> bool:
    return name not in states and name not in ENDS and list(cures.values()).count(name) == 1


class _Meant:
    """What a word that leads to a state stands for."""

    def __init__(self, meant: Mapping[str, str], known: Collection[str]) -> None:
        self.meant = meant
        self.known = known

    def of(self, node: Node) -> Node:
        """Return a word with the name of the state that it means, also if that name was only nearly written."""
        if not isinstance(node, Scalar):
            return node
        near = nearest(node.text, self.meant) if node.text not in self.known else [node.text]
        name = self.meant.get(near[0]) if near else None
        return replace(node, text=name) if name else node


def _renamed(machine: Tree, states: Tree, meant: _Meant) -> Tree:
    entries = {}
    for name, entry in states.entries.items():
        new = meant.meant.get(name, name)
        entries[new] = Entry(replace(entry.key, text=new), _leading(entry.value, meant))
    below = {**machine.entries, "states": Entry(machine.entries["states"].key, replace(states, entries=entries))}
    if "start" in below:
        below["start"] = Entry(below["start"].key, meant.of(below["start"].value))
    return replace(machine, entries=below)


def _leading(state: Node, meant: _Meant) -> Node:
    """Return a state whose `next` leads to states by their names."""
    if not isinstance(state, Tree) or "next" not in state:
        return state
    entry = state.entries["next"]
    to = entry.value
    if isinstance(to, Tree):
        to = replace(to, entries={key: Entry(one.key, meant.of(one.value)) for key, one in to.entries.items()})
    return replace(state, entries={**state.entries, "next": Entry(entry.key, meant.of(to))})


def _ways(machine: Tree, states: Tree) -> Iterator[Scalar]:
    """Yield all words that lead to a state."""
    leads = [machine.get("start")]
    for entry in states.entries.values():
        to = entry.value.get("next") if isinstance(entry.value, Tree) else None
        leads += [one.value for one in to.entries.values()] if isinstance(to, Tree) else [to]
    yield from (one for one in leads if isinstance(one, Scalar))
