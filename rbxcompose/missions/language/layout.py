"""What the keys of steps take, found by running the code that reads each kind on a recording reader."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from rbxcompose.expressions.tree import Expression
from rbxcompose.findings import Finding, Span
from rbxcompose.manifest.tree import Entry, MappingNode, TreeNode
from rbxcompose.missions.language.grammar import BELOW, KeySlot, Takes, Words
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.modifiers.registry import modifier_keys, modifiers
from rbxcompose.missions.program.registry import StepType, kinds


class Nobody:
    """Ignores whatever a reader hands on: there is nothing to read."""

    def child(self, node: TreeNode, step: str, parent: int) -> int:
        """Give every node the same number."""
        return 0

    def state(self, name: str, entry: Entry, parent: int) -> int:
        """Give every node the same number."""
        return 0

    def loop(self, item: str, expression: Expression) -> None:
        """Note nothing."""

    def held(self, expression: Expression, parent: int, span: Span) -> list[int]:
        """Return no nodes."""
        return []

    def add(self, finding: Finding) -> None:
        """Drop the finding: an empty mapping lacks everything."""


class _Asking(NodeReader):
    """A reader that claims to have every key but has no values, and records what each key takes."""

    def __init__(self, key: str) -> None:
        super().__init__(MappingNode(), key, 0, Nobody())
        self.slots: dict[str, KeySlot] = {}

    def has(self, key: str) -> bool:
        """Return true, so that every key is requested."""
        return True

    def take(self, key: str, takes: Takes = Takes.OTHER, choices: tuple[str, ...] = ()) -> TreeNode | None:
        """Record what a key takes; the first request says the most."""
        self.slots.setdefault(key, KeySlot(takes, choices))
        return None


def words(skills: frozenset[str] = frozenset()) -> Words:
    """Return the words with a meaning in the missions of a robot with these skills."""
    return _words(_known(), skills)


def step_slots(kind: str) -> Mapping[str, KeySlot]:
    """Return what the keys of a step of this kind take, modifiers included; for no kind, those of a skill."""
    return _step_slots(_known(), kind)


def _known() -> tuple[StepType, ...]:
    """Return the kinds that exist now: tests add some and remove them again."""
    return tuple(kinds().values())


@cache
def _kind_slots(known: tuple[StepType, ...]) -> Mapping[str, Mapping[str, KeySlot]]:
    """Return what the keys of each kind of step take, including its word."""
    found = {}
    for kind in known:
        asking = _Asking(kind.name)
        kind.read(asking)
        found[kind.name] = {key: asking.slots.get(key, KeySlot(Takes.OTHER)) for key in (kind.name, *kind.options)}
    return found


@cache
def _modifier_slots() -> Mapping[str, KeySlot]:
    """Return what the keys of all modifiers take, including those of states."""
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
    """Return what the keys of a state take, modifiers included."""
    return {**_modifier_slots(), **BELOW[Takes.STATE]}
