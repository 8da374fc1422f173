"""Conditions that something waits for: which names wake it, and whether to poll at the mission's rate."""

from __future__ import annotations

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.tree import Expression

POSE = "pose"  # `$pose` changes all the time without a message
_UNANNOUNCED = frozenset({"age", "distance"})


@dataclass(frozen=True, slots=True)
class Watched:
    """A condition, the `$names` that it reads, and whether it may change without a message."""

    condition: Expression
    names: frozenset[str]
    is_polled: bool

    @classmethod
    def of(cls, condition: Expression) -> Watched:
        """Return a condition with its dependencies."""
        names = frozenset(reference.name for reference in condition.names)
        calls = {reference.name for reference in condition.calls}
        return cls(condition, names, POSE in names or bool(calls & _UNANNOUNCED))
