"""Keys of a machine outside it, or at the very left: `ends` in the column of `machine`."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.manifest.tree import Entry, MappingNode, TreeNode, children, with_children
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.program.machines import MACHINE_KEYS
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair

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
