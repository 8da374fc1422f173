"""One of several nodes.

`if`: one node or another, depending on a condition.
`choose`: one of several nodes, depending on a value.
`run`: a node stored in the mission's data.
"""

from __future__ import annotations

from rbxcompose.base.expressions.values import is_same
from rbxcompose.missions import sdk
from rbxcompose.missions.language.literals import HeldNode
from rbxcompose.missions.program.parts import Asked, BranchChoice


class ChosenTask(sdk.Task):
    """Runs the child that it chooses when it begins, or none."""

    __slots__ = ("children", "index")
    saved = ("index",)

    def __init__(self, site: sdk.Site) -> None:
        super().__init__(site)
        self.children = site.children
        self.index = 0  # of the chosen child

    def choose(self) -> int:
        """Return the index of a child; one that does not exist for none."""
        raise NotImplementedError

    def begin(self) -> int:
        """Choose a child and start it."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            self.index = self.choose()
        return self.proceed() if self.index < len(self.children) else sdk.SKIPPED

    def proceed(self) -> int:
        """Continue with the chosen child."""
        return self.advance(self.children[self.index])


class IfTask(ChosenTask):
    """Runs the chosen branch."""

    __slots__ = ("condition",)

    def __init__(self, site: sdk.Site, step: IfStep) -> None:
        super().__init__(site)
        self.condition = step.condition

    def choose(self) -> int:
        """Return the first branch if the condition holds, else the second."""
        return 0 if sdk.holds(self.condition, self.scope) else 1


@sdk.kind("if", IfTask)
@sdk.dataclass(frozen=True, slots=True)
class IfStep(sdk.Choosing):
    """Evaluate a condition once, then do `then` or `else`; skipped without a match.

    Example:
        do:
          if: $battery < 90 %
          then:
            - go_to: dock
            - recharge
          else:
            log: The battery has $battery
    """

    condition: sdk.Expression = sdk.condition()
    then = sdk.child("What is done if the condition holds.")
    otherwise = sdk.child("What is done if it does not.", "else", optional=True)

    ways = ("then", "else")
    sentence = sdk.says("If {condition:if}")

    def before(self, index: int) -> str:
        """Say which branch is for the contrary."""
        return "Otherwise" if index else ""

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the outcomes of both branches; a condition that cannot be evaluated is a failure."""
        found = sdk.ALWAYS_SUCCEEDS.both(sdk.either(map(endings.of, node.children)))
        return found if sdk.is_simple(node) else found.both(sdk.ALWAYS_FAILS)


class ChooseTask(ChosenTask):
    """Runs the chosen case."""

    __slots__ = ("choice",)

    def __init__(self, site: sdk.Site, step: ChooseStep) -> None:
        super().__init__(site)
        self.choice = step.choice

    def choose(self) -> int:
        """Return the first case that equals the value, else what is behind the last one."""
        value = sdk.evaluate(self.choice.asked, self.scope)
        for index, case in enumerate(self.choice.cases):
            if is_same(sdk.evaluate(case.expression, self.scope), value):
                return index
        return len(self.choice.cases)


@sdk.kind("choose", ChooseTask)
@sdk.dataclass(frozen=True, slots=True)
class ChooseStep(sdk.Choosing):
    """Do the case that matches a value, which is read once; skipped without a match.

    Example:
        data:
          room: kitchen
        do:
          choose: $room
          cases:
            kitchen:
              log: Mopping
            hallway:
              log: Sweeping
          else:
            log: Nothing to do in $room
    """

    value: sdk.Expression = sdk.value("a value, such as '$room'")
    cases: tuple[Asked, ...] = sdk.cases("What is done for which value.")
    otherwise = sdk.child("What is done for all other values.", "else", optional=True)  # the last child

    sentence = sdk.says("Depending on {value}")

    def before(self, index: int) -> str:
        """Say the value of a case."""
        is_case = index < len(self.cases)
        return f"If it is {sdk.spoken(self.cases[index].expression)}" if is_case else "Otherwise"

    @property
    def choice(self) -> BranchChoice:
        """Return the value and the cases."""
        return BranchChoice(self.value, self.cases)

    @property
    def ways(self) -> tuple[str, ...]:
        """Return the cases, and `else` for all other values."""
        return (*(f"case {case.expression.text}" for case in self.cases), "else")

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the outcomes of all cases; a missing value is a failure."""
        found = sdk.ALWAYS_SUCCEEDS.both(sdk.either(map(endings.of, node.children)))
        return found.both(sdk.ALWAYS_FAILS) if node.asked else found


class RunTask(ChosenTask):
    """Runs the node that its expression yields."""

    __slots__ = ("expression", "keys")

    def __init__(self, site: sdk.Site, step: RunStep) -> None:
        super().__init__(site)
        self.expression = step.expression
        nodes = site.engine.program.nodes
        self.keys = {nodes[child].held: index for index, child in enumerate(site.node.children)}

    def choose(self) -> int:
        """Look the node up."""
        value = sdk.evaluate(self.expression, self.scope)
        if not isinstance(value, HeldNode) or value.key not in self.keys:
            raise sdk.NodeFailed(f"'run' needs a node from the data, not {self.run.show('', value)}")
        return self.keys[value.key]


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
