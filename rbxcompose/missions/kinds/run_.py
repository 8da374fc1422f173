"""`run`: a node stored in the mission's data."""

from __future__ import annotations

from rbxcompose.missions import sdk
from rbxcompose.missions.analysis.held_nodes import HeldNode


class RunTask(sdk.Task):
    """Runs the node that its expression yields."""

    __slots__ = ("children", "expression", "index", "keys")
    saved = ("index",)

    def __init__(self, site: sdk.Site, step: RunStep) -> None:
        super().__init__(site)
        self.expression = step.expression
        self.children = site.children
        nodes = site.engine.program.nodes
        self.keys = {nodes[child].held: index for index, child in enumerate(site.node.children)}
        self.index = 0  # of the child that runs

    def begin(self) -> int:
        """Look the node up, and start it."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            value = sdk.evaluate(self.expression, self.scope)
            if not isinstance(value, HeldNode) or value.key not in self.keys:
                raise sdk.NodeFailed(f"'run' needs a node from the data, not {self.run.show('', value)}")
            self.index = self.keys[value.key]
        return self.proceed()

    def proceed(self) -> int:
        """Continue with the node."""
        return self.advance(self.children[self.index])


@sdk.kind("run", RunTask)
@sdk.dataclass(frozen=True, slots=True)
class RunStep(sdk.Straight):
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

    expression: sdk.Expression = sdk.value("data that hold a node, such as '$chore'", holds_nodes=True)

    skipped = sdk.Skipped.PERHAPS
    flow = sdk.NodeFlow.OPEN
    look = sdk.PLAIN
    sentence = sdk.says("Do {expression}")

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the outcomes of all these nodes; it fails if the data have no node there."""
        return sdk.either([sdk.ALWAYS_FAILS, *map(endings.of, node.children)]) if node.children else sdk.ANY
