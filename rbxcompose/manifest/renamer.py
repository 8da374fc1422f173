"""What a section may ask of the renaming of a part that brings it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from rbxcompose.findings import Span
from rbxcompose.manifest.tree import TreeNode


@dataclass(frozen=True, slots=True)
class RenamedTopic:
    """Another name for a topic of a part, and where it is written."""

    name: str
    span: Span
    key_span: Span


class Renames(Protocol):
    """The names of one instance of a part, and what they become in the file that includes it."""

    @property
    def prefix(self) -> str:
        """Return what comes in front of its names."""
        ...

    @property
    def running(self) -> frozenset[str]:
        """Return the names of all that the part runs."""
        ...

    def component(self, name: str) -> str:
        """Return what the name of something that runs becomes; `component.port` keeps its port."""
        ...

    def topic(self, topic: str) -> str:
        """Return what a topic becomes."""
        ...

    def written(self, topic: str) -> RenamedTopic:
        """Return what gives a topic its other name: itself, or the topic that it stands below."""
        ...

    def topics(self, node: TreeNode, above: str = "") -> TreeNode:
        """Return a map whose keys are topics (below `above`, if given) with these changed."""
        ...

    def texts(self, node: TreeNode, change: Callable[[str], str]) -> TreeNode:
        """Return a node with every text below it changed, but for those that are filled in later."""
        ...
