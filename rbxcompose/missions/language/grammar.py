"""The places of a mission's grammar: what may be at each, for the slips that are recognised there."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from rbxcompose.findings import Span
from rbxcompose.manifest.tree import BROKEN, Entry, MappingNode, ScalarNode, SequenceNode, TreeNode

LEVELS = 40  # of steps within steps
LIST = "sequence"  # what a list is
EACH = "*"  # stands for every key of a map and every item of a list


class Takes(StrEnum):
    """What a place of the grammar takes."""

    MISSION = "mission"
    INTERRUPTS = "interrupts"
    INTERRUPT = "interrupt"
    AFTERWARDS = "afterwards"
    STEP = "step"
    STEPS = "steps"
    BRANCHES = "branches"
    CASES = "cases"
    MACHINE = "machine"
    STATES = "states"
    STATE = "state"
    NEXT = "next"
    HOOK = "hook"
    ASSIGNMENTS = "assignments"
    ITEMS = "items"
    ITEM_NAME = "item name"
    COUNT = "count"
    FLAG = "flag"
    OTHER = "other"


class KeySlot(NamedTuple):
    """What the value of a key takes; `choices` are words that may stand in its place."""

    takes: Takes
    choices: tuple[str, ...] = ()


STEP = KeySlot(Takes.STEP)
# What stands below each place, by its key. What the keys of a step take, its kind and its modifiers tell.
BELOW: Mapping[Takes, Mapping[str, KeySlot]] = {
    Takes.MISSION: {"do": STEP, "machine": KeySlot(Takes.MACHINE), "interrupts": KeySlot(Takes.INTERRUPTS)},
    Takes.INTERRUPTS: {EACH: KeySlot(Takes.INTERRUPT)},
    Takes.INTERRUPT: {"do": STEP, "afterwards": KeySlot(Takes.AFTERWARDS)},
    Takes.STEPS: {EACH: STEP},
    Takes.BRANCHES: {EACH: STEP},
    Takes.CASES: {EACH: STEP},
    Takes.MACHINE: {"states": KeySlot(Takes.STATES)},
    Takes.STATES: {EACH: KeySlot(Takes.STATE)},
    Takes.STATE: {"do": STEP, "machine": KeySlot(Takes.MACHINE), "next": KeySlot(Takes.NEXT)},
    Takes.HOOK: {"set": KeySlot(Takes.ASSIGNMENTS)},
}


@dataclass(frozen=True, slots=True)
class Words:
    """The words that mean something in a mission: of the language, and the skills of the robot as far as known."""

    kinds: Mapping[str, Mapping[str, KeySlot]]  # what the keys of each kind of step take, its own word among them
    modifiers: Mapping[str, KeySlot]  # of any step, `name` among them
    skills: Collection[str] = ()

    def is_step(self, word: str) -> bool:
        """Return whether a word is that of a kind, or a skill of the robot."""
        return word in self.kinds or word in self.skills

    def is_option(self, key: str) -> bool:
        """Return whether some kind has a key of this name beside its word."""
        return bool(self.owners(key))

    def owners(self, key: str) -> str:
        """Return, for people, the kinds that have such a key beside their word; nothing if there are none."""
        return " and ".join(f"'{kind}'" for kind, slots in self.kinds.items() if key in slots and key != kind)

    def own(self, step: MappingNode) -> list[str]:
        """Return the keys of a step that not every step may have."""
        return [key for key in step.entries if key not in self.modifiers]

    def kind_of(self, step: MappingNode) -> str:
        """Return the word of the kind of a step; nothing for a skill. `if` beside another step is no step."""
        own = self.own(step)
        found = (key for key in own if key in self.kinds and (key != "if" or "then" in step or own[0] == key))
        return next(found, "")


@dataclass(frozen=True, slots=True)
class GrammarPlace:
    """A place of the grammar: what it takes, and the key behind which it stands."""

    takes: Takes
    key: ScalarNode
    words: Words
    choices: tuple[str, ...] = ()


def long_form(step: TreeNode) -> MappingNode:
    """Return a step as a map: a list is a sequence, a word is a skill without arguments."""
    match step:
        case MappingNode():
            return step
        case SequenceNode(span=span):
            return MappingNode({LIST: Entry(ScalarNode(LIST, span), step)}, span)
        case ScalarNode(text=text, span=span):
            return MappingNode({text: Entry(step, ScalarNode("", span))}, span)


def is_empty(node: TreeNode) -> bool:
    """Return whether nothing was written: `do:` with no value."""
    return isinstance(node, ScalarNode) and node.plain and not node.text


def told(span: Span) -> ScalarNode:
    """Return what stands for a value of which all was said."""
    return ScalarNode("", span, filled=BROKEN)


def without_word(step: MappingNode, words: Words) -> MappingNode:
    """Return a step of whose word all was said: what is left of it are its modifiers."""
    left = {key: entry for key, entry in step.entries.items() if key in words.modifiers}
    return MappingNode({"": Entry(told(step.span), told(step.span)), **left}, step.span)


def is_told(node: TreeNode | None) -> bool:
    """Return whether all was said of a value, or of the word of a step."""
    if isinstance(node, MappingNode) and "" in node:
        node = node.entries[""].key
    return isinstance(node, ScalarNode) and node.filled is BROKEN
