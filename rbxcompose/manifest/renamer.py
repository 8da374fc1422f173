"""What a section can request when the names of a part are changed for an instance of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Span
from rbxcompose.manifest.tree import TreeNode


@dataclass(frozen=True, slots=True)
class RenamedTopic:
    """The new name of a topic of a part, and where it is written."""

    name: str
    span: Span
    key_span: Span


class Renames(Protocol):
    """The names of one instance of a part, and what they become in the file that includes it."""

    @property
    def prefix(self) -> str:
        """Return the prefix of its names."""
        ...

    @property
    def running(self) -> frozenset[str]:
        """Return the names of all that the part runs."""
        ...

    def component(self, name: str) -> str:
        """Return the new name of something that runs; `component.port` keeps its port."""
        ...

    def topic(self, topic: str) -> str:
        """Return the new name of a topic."""
        ...

    def written(self, topic: str) -> RenamedTopic:
        """Return the entry that renames a topic: its own, or that of a topic above it."""
        ...

    def topics(self, node: TreeNode, above: str = "") -> TreeNode:
        """Return a map whose keys are topics (below `above`, if given) with these keys renamed."""
        ...

    def texts(self, node: TreeNode, change: Callable[[str], str]) -> TreeNode:
        """Return a node with every text below it changed, except those that are filled in later."""
        ...
