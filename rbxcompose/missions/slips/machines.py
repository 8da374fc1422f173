"""Machines: keys beside them, names of states, and transitions that ask."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

from rbxcompose.base.findings import Edit, Finding, Fix, nearest
from rbxcompose.manifest.slips import Repair
from rbxcompose.manifest.tree import Entry, Key, MappingNode, ScalarNode, TreeNode, all_nodes, children, with_children
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, placeholder
from rbxcompose.missions.language.value_reader import NAME, invalid_name, valid_name
from rbxcompose.missions.program.branches import CONDITIONAL
from rbxcompose.missions.program.machines import ENDS, MACHINE_KEYS
from rbxcompose.missions.slips import slip

MACHINE = "machine"


@slip(Takes.MISSION, Takes.STEP, Takes.STATE)
def keys_outside_their_machine(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a machine's keys beside it, and those of any machine at the very left of a mission.

    The latter are moved to the machine that they may belong to, if there is only one.
    """
    if not isinstance(node, MappingNode) or not any(key in node for key in MACHINE_KEYS):
        return None
    own, is_mission = _machine_of(node), place.takes is Takes.MISSION
    pairs = list(_machines(node)) if is_mission else []
    strays = [key for key in MACHINE_KEYS if key in node and ((own and key not in own) or pairs)]
    if not strays:
        return None
    added: dict[int, dict[str, Entry]] = {}  # by the identity of the machine
    for key in strays:
        homes = [machine for holder, machine in pairs if key not in machine and key not in holder]
        home = own if own and key not in own else homes[0] if len(homes) == 1 else None
        added.setdefault(id(home), {})[key] = node.entries[key]
    help_text = f"move it right, below '{MACHINE}:', into the column of 'states'"
    findings = (
        codes.WRONG_SHAPE.at(node.entries[key].key.span, f"'{key}' belongs to the machine", help=help_text)
        for key in strays
    )
    left = {key: entry for key, entry in node.entries.items() if key not in strays}
    return Repair(_with(MappingNode(left, node.span), added), tuple(findings))


def _machine_of(node: TreeNode) -> MappingNode | None:
    """Return the machine in a map; it must have states to count as one."""
    machine = node.get(MACHINE) if isinstance(node, MappingNode) else None
    return machine if isinstance(machine, MappingNode) and "states" in machine else None


def _machines(root: MappingNode) -> Iterator[tuple[MappingNode, MappingNode]]:
    """Yield all maps with a machine, and their machine."""
    waiting: list[TreeNode] = [root]
    while waiting:
        node = waiting.pop()
        if isinstance(node, MappingNode) and (machine := _machine_of(node)):
            yield node, machine
        waiting += (below for _, below in children(node))


def _with(node: TreeNode, added: dict[int, dict[str, Entry]]) -> TreeNode:
    """Return a tree with the additions to each machine."""
    new = with_children(node, lambda _, below: _with(below, added))
    more = added.get(id(node), {})
    return MappingNode({**new.entries, **more}, new.span, new.tag) if more and isinstance(new, MappingNode) else new


@slip(Takes.MACHINE)
def misnamed_states(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise states with names such as `go home`."""
    states = node.get("states") if isinstance(node, MappingNode) else None
    wrong = [name for name in states.entries if not NAME.fullmatch(name)] if isinstance(states, MappingNode) else []
    if not isinstance(states, MappingNode) or not isinstance(node, MappingNode) or not wrong:
        return None
    cures = {name: valid_name(name) for name in wrong}
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
    edits = tuple(Edit(place.span, name, meant) for place in places)
    return invalid_name(places[0], Fix(edits, True, f"'{name}' -> '{meant}'") if meant else None)


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
    yield from (lead for lead in leads if isinstance(lead, ScalarNode))


@slip(Takes.STATE)
def asking_next(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise words that begin a condition, unless they are outcomes of this state: these are refused there."""
    to = node.get("next") if isinstance(node, MappingNode) else None
    asking = (
        [entry.key for word, entry in to.entries.items() if word in CONDITIONAL] if isinstance(to, MappingNode) else []
    )
    if not asking:
        return None
    below = [one.get("outcomes") for one in all_nodes(node) if isinstance(one, MappingNode)]
    if any(key in outcomes for outcomes in below if isinstance(outcomes, MappingNode) for key in CONDITIONAL):
        return None
    help_text = (
        "let a 'check' be the last step of this state, and write below 'next' where 'success' and 'failure' lead"
    )
    message = f"'next' takes no conditions: there is no '{asking[0].text}' in it"
    repaired = with_children(node, lambda key, value: placeholder(value.span) if key == "next" else value)
    return Repair(repaired, (codes.WRONG_SHAPE.at(asking[0].span, message, help=help_text),))
