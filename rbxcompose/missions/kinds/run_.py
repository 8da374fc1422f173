"""`run`: a node that the mission's data hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.tree import Expression
from rbxcompose.expressions.types import UNKNOWN
from rbxcompose.missions.held import HeldNode
from rbxcompose.missions.registry import kind
from rbxcompose.missions.task import NodeFailed, Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


@kind("run")
class Run(Task):
    """Do a node that stands in the data: a chore of a list, a step that was chosen before.

    Example:
        data:
          steps:
            - go_to: corner_1
            - log: Here I am
        do:
          for: step
          in: $steps
          do:
            run: $step
    """

    __slots__ = ("children", "expression", "index", "keys")
    saved = ("index",)

    def __init__(self, site: Site, options: Expression) -> None:
        super().__init__(site)
        self.expression = options
        self.children = site.children
        nodes = site.engine.program.nodes
        self.keys = {nodes[child].held: index for index, child in enumerate(site.node.children)}
        self.index = 0  # of the child that is done

    @staticmethod
    def read(reader: NodeReader) -> Expression:
        """Read the expression; the nodes that it may give are read from the data."""
        expression = reader.expression(reader.key, UNKNOWN, "data that hold a node, such as '$chore'")
        reader.held(expression)
        return expression

    def begin(self) -> int:
        """Look the node up, and start it."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            value = evaluate(self.expression, self.scope)
            if not isinstance(value, HeldNode) or value.key not in self.keys:
                raise NodeFailed(f"'run' needs a node from the data, not {self.run.show('', value)}")
            self.index = self.keys[value.key]
        return self.proceed()

    def proceed(self) -> int:
        """Go on with it."""
        return self.advance(self.children[self.index])
