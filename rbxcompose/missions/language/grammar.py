"""The places of a mission's grammar: what each takes, for the slips that are recognised there; and its words."""

from collections.abc import Collection, Mapping
from enum import StrEnum
from typing import NamedTuple

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import BROKEN, Entry, MappingNode, ScalarNode, SequenceNode, TreeNode

LEVELS = 40  # of nested steps
LIST = "sequence"  # the kind of a bare list
EACH = "*"  # means every key of a map and every item of a list


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
    CONDITION = "condition"
    WATCHED = "watched condition"
    DURATION = "duration"
    VALUE = "value"
    CHOICE = "choice"
    TEXT = "text"
    WORD = "word"
    NAME = "name"
    BRANCH = "branch"
    RECORD = "record"
    INPUTS = "inputs"
    OUTCOMES = "outcomes"
    CONTENTS = "contents"


class KeySlot(NamedTuple):
    """What a key takes as its value; `choices` are words that it takes instead."""

    takes: Takes
    choices: tuple[str, ...] = ()


STEP = KeySlot(Takes.STEP)
# What each place takes below it, by key. What the keys of a step take is up to its kind and its modifiers.
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
    """The words with a meaning in a mission: those of the language, and the robot's skills as far as known."""

    kinds: Mapping[str, Mapping[str, KeySlot]]  # what the keys of each kind of step take, including its word
    modifiers: Mapping[str, KeySlot]  # of any step, including `name`
    skills: Collection[str] = ()

    def is_step(self, word: str) -> bool:
        """Return whether a word is that of a kind or the name of a skill of the robot."""
        return word in self.kinds or word in self.skills

    def is_option(self, key: str) -> bool:
        """Return whether any kind has a key of this name beside its word."""
        return bool(self.owners(key))

    def owners(self, key: str) -> str:
        """Return in words the kinds that have such a key beside their word; empty if there are none."""
        return " and ".join(f"'{kind}'" for kind, slots in self.kinds.items() if key in slots and key != kind)

    def own(self, step: MappingNode) -> list[str]:
        """Return the keys of a step except those that every step may have."""
        return [key for key in step.entries if key not in self.modifiers]

    def kind_of(self, step: MappingNode) -> str:
        """Return the word of a step's kind; empty for a skill. `if` beside another step is no step."""
        own = self.own(step)
        found = (key for key in own if key in self.kinds and (key != "if" or "then" in step or own[0] == key))
        return next(found, "")


@dataclass(frozen=True, slots=True)
class GrammarPlace:
    """A place of the grammar: what it takes, and the key in front of it."""

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


def placeholder(span: Span) -> ScalarNode:
    """Return a placeholder for a value that needs no further finding."""
    return ScalarNode("", span, filled=BROKEN)


def without_word(step: MappingNode, words: Words) -> MappingNode:
    """Return a step reduced to its modifiers; its word needs no further finding."""
    left = {key: entry for key, entry in step.entries.items() if key in words.modifiers}
    return MappingNode({"": Entry(placeholder(step.span), placeholder(step.span)), **left}, step.span)


def is_reported(node: TreeNode | None) -> bool:
    """Return whether a value, or the word of a step, needs no further finding."""
    if isinstance(node, MappingNode) and "" in node:
        node = node.entries[""].key
    return isinstance(node, ScalarNode) and node.filled is BROKEN


BODIES = ("do", "machine")
STATE_KEYS = (*BODIES, "on_enter", "on_exit", "next")


_OURS = {
    "fallback": "selector sel priority_selector",
    "sequence": "seq steps sequential",
    "parallel": "par simultaneously together concurrently",
    "repeat": "loop",
    "for": "foreach for_each",
    "wait": "sleep delay pause",
    "choose": "switch match case",
    "log": "print echo",
    "use": "subtree sub_tree submission include",
    "run": "exec script",
    "end": "return stop exit abort terminate",
    "wait_for": "wait_until await wait_template wait_for_trigger",
}
FOREIGN: Mapping[str, str] = {name: ours for ours, names in _OURS.items() for name in names.split()}
"""Our word for each of another mission language or of a behaviour tree."""

OUTCOMES: Mapping[str, str] = {
    **dict.fromkeys(("succeeded", "succeed", "succeeds", "done", "ok", "true"), "success"),
    **dict.fromkeys(("aborted", "failed", "fail", "fails", "error", "preempted", "canceled", "false"), "failure"),
}
"""Our outcome for each of other mission languages."""


NO_HISTORY, LAST, DEEP = "none", "last", "deep"
HISTORIES = (NO_HISTORY, LAST, DEEP)  # the default first
