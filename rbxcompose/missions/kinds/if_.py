"""`if`: one node or another, depending on a condition."""

from __future__ import annotations

from rbxcompose.missions import sdk


class IfTask(sdk.Task):
    """Runs the chosen branch."""

    __slots__ = ("branches", "condition", "index")
    saved = ("index",)

    def __init__(self, site: sdk.Site, step: IfStep) -> None:
        super().__init__(site)
        self.condition = step.condition
        self.branches = site.children
        self.index = 0  # of the chosen branch

    def begin(self) -> int:
        """Choose a branch and start it."""
        if not (self.engine.places.kept and self.engine.places.take_up(self)):
            self.index = 0 if sdk.holds(self.condition, self.scope) else 1
        return self.proceed() if self.index < len(self.branches) else sdk.SKIPPED

    def proceed(self) -> int:
        """Continue with the chosen branch."""
        return self.advance(self.branches[self.index])


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
