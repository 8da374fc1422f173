"""States with invalid names: each is read under the intended name, wherever its machine names it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

from rbxcompose.findings import Edit, Finding, Fix, nearest
from rbxcompose.manifest.tree import Entry, Key, MappingNode, ScalarNode, TreeNode, with_children
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.language.names import NAME, cure, no_name
from rbxcompose.missions.program.machines import ENDS
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair


@slip(Takes.MACHINE)
def misnamed_states(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise states with names such as `go home`."""
    states = node.get("states") if isinstance(node, MappingNode) else None
    wrong = [name for name in states.entries if not NAME.fullmatch(name)] if isinstance(states, MappingNode) else []
    if not isinstance(states, MappingNode) or not isinstance(node, MappingNode) or not wrong:
        return None
    cures = {name: cure(name) for name in wrong}
    counts = Counter(cures.values())
    taken = {*states.entries, *ENDS}
    meant = {name: new for name, new in cures.items() if new and new not in taken and counts[new] == 1}
    places: dict[str, list[ScalarNode]] = {name: [states.entries[name].key] for name in wrong}
    for way in _ways(node, states):
        places.get(way.text, []).append(way)
    ends = node.get("ends")
    known = {*states.entries, *ENDS, *(ends.entries if isinstance(ends, MappingNode) else ())}
    findings = tuple(_no_name(name, places[name], meant.get(name, "")) for name in wrong)
    return Repair(_renamed(node, states, _Meant(meant, known)), findings)


def _no_name(name: str, places: list[ScalarNode], meant: str) -> Finding:
    edits = tuple(Edit(one.span, name, meant) for one in places)
    return no_name(places[0], Fix(edits, True, f"'{name}' -> '{meant}'") if meant else None)


class _Meant:
    """The states that words in transitions mean."""

    def __init__(self, meant: Mapping[str, str], known: Collection[str]) -> None:
        self.meant = meant
        self.known = known

    def of(self, node: TreeNode) -> TreeNode:
        """Return a word replaced by the name of the state that it means, even if it is slightly misspelt."""
        if not isinstance(node, ScalarNode):
            return node
        near = nearest(node.text, self.meant) if node.text not in self.known else [node.text]
        name = self.meant.get(near[0]) if near else None
        return replace(node, text=name) if name else node


def _renamed(machine: MappingNode, states: MappingNode, meant: _Meant) -> MappingNode:
    entries = {}
    for name, entry in states.entries.items():
        new = meant.meant.get(name, name)
        entries[new] = Entry(replace(entry.key, text=new), _leading(entry.value, meant))
    below = {**machine.entries, "states": Entry(machine.entries["states"].key, replace(states, entries=entries))}
    if "start" in below:
        below["start"] = Entry(below["start"].key, meant.of(below["start"].value))
    return replace(machine, entries=below)


def _leading(state: TreeNode, meant: _Meant) -> TreeNode:
    """Return a state whose `next` has the intended names of states."""

    def leads(key: Key, to: TreeNode) -> TreeNode:
        if key != "next":
            return to
        return with_children(to, lambda _, one: meant.of(one)) if isinstance(to, MappingNode) else meant.of(to)

    return with_children(state, leads) if isinstance(state, MappingNode) else state


def _ways(machine: MappingNode, states: MappingNode) -> Iterator[ScalarNode]:
    """Yield all words that name the state to enter."""
    leads = [machine.get("start")]
    for entry in states.entries.values():
        to = entry.value.get("next") if isinstance(entry.value, MappingNode) else None
        leads += [one.value for one in to.entries.values()] if isinstance(to, MappingNode) else [to]
    yield from (one for one in leads if isinstance(one, ScalarNode))
