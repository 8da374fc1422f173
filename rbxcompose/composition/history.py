"""Provenance: the layers that gave a value at a path of the composed robot, from the first to the effective one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Span
from rbxcompose.manifest.tree import KeyPath, MappingNode, TreeNode, at

ROBOT_LAYER = "the robot"


@dataclass(frozen=True, slots=True)
class HistoryStep:
    """What one layer wrote: a node with its place, or None if it removed the value."""

    layer: str
    node: TreeNode | None
    span: Span


@dataclass(slots=True)
class History:
    """All that the layers wrote, in order; nodes are as written, with `${...}` not filled in.

    It keeps only what a layer added, replaced or removed as a whole, so it costs no more than the changes.
    """

    _steps: dict[KeyPath, list[tuple[int, HistoryStep]]] = field(default_factory=dict)
    _count: int = 0

    def write(self, path: KeyPath, step: HistoryStep) -> None:
        """Record what a layer did at `path`."""
        self._count += 1
        self._steps.setdefault(path, []).append((self._count, step))

    @property
    def paths(self) -> Iterable[KeyPath]:
        """Return every path that a layer wrote."""
        return self._steps.keys()

    def of(self, path: KeyPath) -> tuple[HistoryStep, ...]:
        """Return every layer's value at `path`, the effective one last; empty if no layer ever wrote there.

        A last step without a node means that the value was removed.
        """
        found: list[HistoryStep] = []
        for step in self._all(path):
            if step.node is not None or (found and found[-1].node is not None):
                found.append(step)
        return tuple(found)

    def removed(self, section: str) -> dict[str, Span]:
        """Return the removed entries of a section, each with the place that removed it."""
        names = {path[1] for path in self._steps if len(path) == 2 and path[0] == section}
        names |= {
            name for step in self.of((section,)) if isinstance(step.node, MappingNode) for name in step.node.entries
        }
        last = {str(name): steps[-1] for name in names if (steps := self.of((section, name)))}
        return {name: step.span for name, step in last.items() if step.node is None}

    def layer(self, path: KeyPath) -> str:
        """Return the layer with the effective value at `path`, or at the nearest path above that has one."""
        for length in range(len(path), -1, -1):
            if steps := self.of(path[:length]):
                return steps[-1].layer
        return ""

    def _all(self, path: KeyPath) -> Iterator[HistoryStep]:
        reaching = [
            (order, step, path[length:])
            for length in range(len(path) + 1)
            for order, step in self._steps.get(path[:length], ())
        ]
        for _, step, rest in sorted(reaching, key=lambda one: one[0]):
            node = at(step.node, rest) if step.node is not None else None
            yield step if node is step.node else HistoryStep(step.layer, node, node.span if node else step.span)
