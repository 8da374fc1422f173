"""The pass before a mission is read: reports slips, and returns a tree in which they are corrected."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Report
from rbxcompose.manifest.tree import Key, MappingNode, ScalarNode, TreeNode, with_children
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
from rbxcompose.missions.language.layout import state_slots, step_slots, words
from rbxcompose.missions.slips import slip
from rbxcompose.slips import repaired


@dataclass(frozen=True, slots=True)
class Repairs:
    """Repairs the slips of one mission, place by place from the outside in."""

    report: Report
    words: Words

    @classmethod
    def of(cls, report: Report, skills: Collection[str]) -> Repairs:
        """Return the repairs for a mission of a robot with these skills, as far as they are known."""
        return cls(report, words(frozenset(skills)))

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
            if inner is None or inner.takes is Takes.OTHER:
                return child
            behind = node.entries[str(name)].key if isinstance(node, MappingNode) else key
            return self._node(inner, behind, child, inside)

        return with_children(node, below) if slots else node

    def _below(self, takes: Takes, node: TreeNode) -> Mapping[str, KeySlot]:
        """Return what a node takes below it, by key."""
        if takes is Takes.STATE:
            return state_slots()
        if takes is Takes.STEP and isinstance(node, MappingNode):
            return step_slots(self.words.kind_of(node))
        return BELOW.get(takes, {})
