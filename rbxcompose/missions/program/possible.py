"""What a mission may do, each with a key that a run reports, so that tests can tell what they covered."""

from __future__ import annotations

from collections.abc import Hashable
from typing import NamedTuple, TypeAlias

from rbxcompose.findings import Span

StateKey: TypeAlias = tuple[Hashable, ...]


class Possibility(NamedTuple):
    """Something that a node may do: its span, its description, and its key."""

    span: Span
    text: str
    key: StateKey


def started(number: int) -> StateKey:
    """Return the key of the start of a node."""
    return ("node", number)


def skipped(number: int) -> StateKey:
    """Return the key of a node that ends skipped."""
    return ("skipped", number)


def ended(leaf: int, outcome: str) -> StateKey:
    """Return the key of a skill that ends with an outcome."""
    return ("skill", leaf, outcome)


def led(machine: int, state: str, to: str, outcome: str = "") -> StateKey:
    """Return the key of a transition; without an outcome, of one on any outcome."""
    return ("transition", machine, state, to, *([outcome] if outcome else []))


def cut(interrupt: str) -> StateKey:
    """Return the key of an interrupt that acts."""
    return ("interrupt", interrupt)
