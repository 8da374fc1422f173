"""What the keys of steps take: runs the code that reads a kind on a reader that records what it reads."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from rbxcompose.expressions.tree import Expression
from rbxcompose.findings import Finding
from rbxcompose.manifest.tree import Entry, MappingNode, TreeNode
from rbxcompose.missions.language.grammar import BELOW, KeySlot, Takes, Words
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.modifiers.registry import modifier_keys, modifiers
from rbxcompose.missions.program.registry import StepType, kinds


class Nobody:
    """Takes what a reader would hand on: there is nothing to be read."""

    def child(self, node: TreeNode, step: str, parent: int) -> int:
        """Give every node the same number."""
        return 0

    def state(self, name: str, entry: Entry, parent: int) -> int:
        """Give every node the same number."""
        return 0

    def loop(self, item: str, expression: Expression) -> None:
        """Note nothing."""

    def held(self, expression: Expression, parent: int) -> list[int]:
        """Find nothing."""
        return []

    def add(self, finding: Finding) -> None:
        """Drop it: an empty mapping lacks everything."""


class _Asking(NodeReader):
    """A reader that has every key and no value, and keeps what each would take."""

    def __init__(self, key: str) -> None:
        super().__init__(MappingNode(), key, 0, Nobody())
        self.slots: dict[str, KeySlot] = {}

    def has(self, key: str) -> bool:
        """Say yes, so that everything is asked for."""
        return True

    def take(self, key: str, takes: Takes = Takes.OTHER, choices: tuple[str, ...] = ()) -> TreeNode | None:
        """Note what a key takes; what it is asked for first says most of it."""
        self.slots.setdefault(key, KeySlot(takes, choices))
        return None


def words(skills: frozenset[str] = frozenset()) -> Words:
    """Return the words that mean something in the missions of a robot with these skills."""
    return _words(_known(), skills)


def step_slots(kind: str) -> Mapping[str, KeySlot]:
    """Return what the keys of a step of a kind take, with its modifiers; of a skill, if it is of none."""
    return _step_slots(_known(), kind)


def _known() -> tuple[StepType, ...]:
    """Return the kinds there are now: tests add some and take them out again."""
    return tuple(kinds().values())


@cache
def _kind_slots(known: tuple[StepType, ...]) -> Mapping[str, Mapping[str, KeySlot]]:
    """Return what the keys of each kind of step take, its word among them."""
    found = {}
    for kind in known:
        asking = _Asking(kind.name)
        kind.read(asking)
        found[kind.name] = {key: asking.slots.get(key, KeySlot(Takes.OTHER)) for key in (kind.name, *kind.options)}
    return found


@cache
def _modifier_slots() -> Mapping[str, KeySlot]:
    """Return what the keys of all modifiers take, those of states among them."""
    found: dict[str, KeySlot] = {"name": KeySlot(Takes.OTHER)}
    for name, cls in modifiers().items():
        asking = _Asking(name)
        cls.read(asking, name)
        found |= {key: asking.slots.get(key, KeySlot(Takes.OTHER)) for key in (name, *cls.keys)}
    return found


@cache
def _words(known: tuple[StepType, ...], skills: frozenset[str]) -> Words:
    return Words(_kind_slots(known), {key: _modifier_slots()[key] for key in ("name", *modifier_keys())}, skills)


@cache
def _step_slots(known: tuple[StepType, ...], kind: str) -> Mapping[str, KeySlot]:
    return {**_words(known, frozenset()).modifiers, **_kind_slots(known).get(kind, {})}


@cache
def state_slots() -> Mapping[str, KeySlot]:
    """Return what the keys of a state take, with its modifiers."""
    return {**_modifier_slots(), **BELOW[Takes.STATE]}
