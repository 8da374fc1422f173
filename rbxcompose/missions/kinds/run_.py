"""`run`: a node stored in the mission's data."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.missions.analysis.held_nodes import HeldNode
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.fields import value
from rbxcompose.missions.program.answers import PLAIN, NodeFlow, Skipped
from rbxcompose.missions.program.families import Straight
from rbxcompose.missions.program.outcomes import ALWAYS_FAILS, ANY, NodeFailed, Outcomes, either
from rbxcompose.missions.program.program import Endings, MissionNode
from rbxcompose.missions.program.registry import kind


class RunTask(Task):
    """Runs the node that its expression yields."""

    __slots__ = ("children", "expression", "index", "keys")
    saved = ("index",)

    def __init__(self, site: Site, step: RunStep) -> None:
        super().__init__(site)
        self.expression = step.expression
        self.children = site.children
        nodes = site.engine.program.nodes
        self.keys = {nodes[child].held: index for index, child in enumerate(site.node.children)}
        self.index = 0  # of the child that runs

    def begin(self) -> int:
        """Look the node up, and start it."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            value = evaluate(self.expression, self.scope)
            if not isinstance(value, HeldNode) or value.key not in self.keys:
                raise NodeFailed(f"'run' needs a node from the data, not {self.run.show('', value)}")
            self.index = self.keys[value.key]
        return self.proceed()

    def proceed(self) -> int:
        """Continue with the node."""
        return self.advance(self.children[self.index])


@kind("run", RunTask)
@dataclass(frozen=True, slots=True)
class RunStep(Straight):
    """Do a node that is stored in the data: a chore of a list, a step chosen earlier.

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

    expression: Expression = value("data that hold a node, such as '$chore'", holds_nodes=True)

    skipped = Skipped.PERHAPS
    flow = NodeFlow.OPEN
    look = PLAIN

    def may_end(self, node: MissionNode, endings: Endings) -> Outcomes:
        """Return the outcomes of all these nodes; it fails if the data have no node there."""
        return either([ALWAYS_FAILS, *map(endings.of, node.children)]) if node.children else ANY
