"""How much of a robot's missions is read: what goes beyond that is reported before it costs time or memory."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.dataclass import dataclass
from rbxcompose.manifest.tree import ScalarNode, TreeNode, children, count

MOST_HELD = 5_000  # values, names and operators of nodes in the data, counted for each `run` that may get them
MOST_WRITTEN = 30_000  # names and operators in all texts

_SHORT = 8  # characters of a text that is not worth counting, such as a number
_OPERATORS = ("$", "<", ">", "=", "+", "-", "*", "/", ",", ".", "(", "[", "'", '"', " and ", " or ", " in ", "not ")


@dataclass(slots=True)
class Budget:
    """What may still be read of the missions of one robot; below zero it is used up."""

    held: int = MOST_HELD
    written: int = MOST_WRITTEN

    def affords_held(self, node: TreeNode) -> bool:
        """Return whether a node in the data may be read once more, and count it."""
        if self.held >= 0:
            self.held -= count(node) + sum(map(operators, _texts(node)))
        return self.held >= 0

    def unaffordable(self, root: TreeNode) -> ScalarNode | None:
        """Count the texts of a mission; return the first that is too much."""
        for one in _texts(root):
            self.written -= operators(one)
            if self.written < 0:
                return one
        return None


def operators(scalar: ScalarNode) -> int:
    """Return about how many names and operators a text has: reading it as an expression takes as many steps."""
    text = scalar.text
    return 0 if len(text) <= _SHORT else sum(map(text.count, _OPERATORS))


def _texts(root: TreeNode) -> Iterator[ScalarNode]:
    """Yield the texts of a tree, the keys of its maps excepted, in the order in which they are written."""
    waiting = [root]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ScalarNode):
            yield node
        else:
            waiting += reversed([child for _, child in children(node)])
