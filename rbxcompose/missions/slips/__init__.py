"""The pass before a mission is read: it reports slips, and returns a tree in which they are corrected.

A slip is a function of a `GrammarPlace` and the node there, under `@slip(PLACES)`, in a file of this package: what is
written, what to say, and what to read instead. It returns None if there is no slip.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Report
from rbxcompose.manifest.slips import Repair, Slips, repaired
from rbxcompose.manifest.tree import Key, MappingNode, ScalarNode, TreeNode, with_children
from rbxcompose.missions.language import grammar
from rbxcompose.missions.language.fields import Declared
from rbxcompose.missions.language.grammar import GrammarPlace
from rbxcompose.missions.modifiers.starts import ON_ENTER
from rbxcompose.missions.program.registry import kinds, modifiers

slip: Slips[Callable[[GrammarPlace, TreeNode], Repair[TreeNode] | None]] = Slips(__name__)


@dataclass(frozen=True, slots=True)
class Repairs:
    """Repairs the slips of one mission, place by place from the outside in."""

    report: Report
    words: grammar.Words

    @classmethod
    def of(cls, report: Report, skills: Collection[str]) -> Repairs:
        """Return the repairs for a mission of a robot with these skills, as far as they are known."""
        of_kinds = {name: _slots(kind) for name, kind in kinds().items()}
        found: dict[str, grammar.KeySlot] = {"name": grammar.KeySlot(grammar.Takes.NAME)}
        for modifier in modifiers().values():
            found |= {} if modifier.only_states else _slots(modifier)
        return cls(report, grammar.Words(of_kinds, found, frozenset(skills)))

    def mission(self, root: MappingNode) -> MappingNode:
        """Return the tree of a mission with its slips repaired."""
        found = self._node(grammar.KeySlot(grammar.Takes.MISSION), ScalarNode("", root.span), root, 0)
        return found if isinstance(found, MappingNode) else root

    def step(self, node: TreeNode, depth: int) -> TreeNode:
        """Return a step at nesting depth `depth` with its slips repaired."""
        return self._node(grammar.KeySlot(grammar.Takes.STEP), ScalarNode("", node.span), node, depth)

    def _node(self, slot: grammar.KeySlot, key: ScalarNode, node: TreeNode, depth: int) -> TreeNode:
        is_step = slot.takes is grammar.Takes.STEP
        if is_step and (depth == grammar.LEVELS or grammar.is_empty(node)):
            return node
        place = grammar.GrammarPlace(slot.takes, key, self.words, slot.choices)
        node = repaired(slip.at(slot.takes), place, grammar.long_form(node) if is_step else node, self.report)
        slots = self._below(slot.takes, node)
        inside = depth + (slot.takes in (grammar.Takes.STEP, grammar.Takes.STATE))

        def below(name: Key, child: TreeNode) -> TreeNode:
            inner = slots.get(str(name)) or slots.get(grammar.EACH)
            if inner is None:
                return child
            behind = node.entries[str(name)].key if isinstance(node, MappingNode) else key
            return self._node(inner, behind, child, inside)

        return with_children(node, below) if slots else node

    def _below(self, takes: grammar.Takes, node: TreeNode) -> Mapping[str, grammar.KeySlot]:
        """Return what a node takes below it, by key."""
        if takes is grammar.Takes.STATE:
            return {**self.words.modifiers, **_slots(modifiers()[ON_ENTER]), **grammar.BELOW[grammar.Takes.STATE]}
        if takes is grammar.Takes.STEP and isinstance(node, MappingNode):
            return {**self.words.modifiers, **self.words.kinds.get(self.words.kind_of(node), {})}
        return grammar.BELOW.get(takes, {})


def _slots(cls: type[Declared]) -> dict[str, grammar.KeySlot]:
    return {key: field.slot for key, field in cls.fields.items()}
