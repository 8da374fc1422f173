"""The pass before a mission is read: reports slips, and returns a tree in which they are corrected."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Report
from rbxcompose.base.slips import repaired
from rbxcompose.manifest.tree import Key, MappingNode, ScalarNode, TreeNode, with_children
from rbxcompose.missions.language.fields import Declared
from rbxcompose.missions.language.grammar import (
    BELOW,
    EACH,
    LEVELS,
    GrammarPlace,
    KeySlot,
    Takes,
    Words,
    is_empty,
    long_form,
)
from rbxcompose.missions.modifiers.registry import modifiers
from rbxcompose.missions.modifiers.state_hooks import ON_ENTER
from rbxcompose.missions.program.registry import kinds
from rbxcompose.missions.slips import slip


@dataclass(frozen=True, slots=True)
class Repairs:
    """Repairs the slips of one mission, place by place from the outside in."""

    report: Report
    words: Words

    @classmethod
    def of(cls, report: Report, skills: Collection[str]) -> Repairs:
        """Return the repairs for a mission of a robot with these skills, as far as they are known."""
        of_kinds = {name: _slots(kind) for name, kind in kinds().items()}
        found: dict[str, KeySlot] = {"name": KeySlot(Takes.NAME)}
        for modifier in modifiers().values():
            found |= {} if modifier.only_states else _slots(modifier)
        return cls(report, Words(of_kinds, found, frozenset(skills)))

    def mission(self, root: MappingNode) -> MappingNode:
        """Return the tree of a mission with its slips repaired."""
        found = self._node(KeySlot(Takes.MISSION), ScalarNode("", root.span), root, 0)
        return found if isinstance(found, MappingNode) else root

    def step(self, node: TreeNode, depth: int) -> TreeNode:
        """Return a step at nesting depth `depth` with its slips repaired."""
        return self._node(KeySlot(Takes.STEP), ScalarNode("", node.span), node, depth)

    def _node(self, slot: KeySlot, key: ScalarNode, node: TreeNode, depth: int) -> TreeNode:
        is_step = slot.takes is Takes.STEP
        if is_step and (depth == LEVELS or is_empty(node)):
            return node
        place = GrammarPlace(slot.takes, key, self.words, slot.choices)
        node = repaired(slip.at(slot.takes), place, long_form(node) if is_step else node, self.report)
        slots = self._below(slot.takes, node)
        inside = depth + (slot.takes in (Takes.STEP, Takes.STATE))

        def below(name: Key, child: TreeNode) -> TreeNode:
            inner = slots.get(str(name)) or slots.get(EACH)
            if inner is None:
                return child
            behind = node.entries[str(name)].key if isinstance(node, MappingNode) else key
            return self._node(inner, behind, child, inside)

        return with_children(node, below) if slots else node

    def _below(self, takes: Takes, node: TreeNode) -> Mapping[str, KeySlot]:
        """Return what a node takes below it, by key."""
        if takes is Takes.STATE:
            return {**self.words.modifiers, **_slots(modifiers()[ON_ENTER]), **BELOW[Takes.STATE]}
        if takes is Takes.STEP and isinstance(node, MappingNode):
            return {**self.words.modifiers, **self.words.kinds.get(self.words.kind_of(node), {})}
        return BELOW.get(takes, {})


def _slots(cls: type[Declared]) -> dict[str, KeySlot]:
    return {key: field.slot for key, field in cls.fields.items()}
