"""`wait_for`: until a condition holds."""

from __future__ import annotations

from rbxcompose.missions import sdk


class WaitForTask(sdk.Task):
    """Evaluates the condition whenever its value may have changed."""

    __slots__ = ("watched",)

    def __init__(self, site: sdk.Site, step: WaitForStep) -> None:
        super().__init__(site)
        self.watched = sdk.Watched.of(step.condition)

    def begin(self) -> int:
        """Evaluate the condition for the first time."""
        return self.proceed()

    def proceed(self) -> int:
        """Evaluate the condition again."""
        if sdk.holds(self.watched.condition, self.scope):
            return sdk.SUCCESS
        self.engine.watch(self.watched)
        return sdk.RUNNING

    def suspend(self, from_start: bool) -> bool:
        """Return whether it starts again; there is nothing to stop."""
        if from_start:
            self.statuses[self.number] = sdk.IDLE
        return from_start


@sdk.kind("wait_for", WaitForTask)
@sdk.dataclass(frozen=True, slots=True)
class WaitForStep(sdk.LeafStep):
    """Succeed as soon as the condition holds; `timeout` limits the wait.

    Example:
        do:
          wait_for: $battery > 50 %
          timeout: 1 min
    """

    condition: sdk.Expression = sdk.watched()

    waits = True
    has_result = False
    lasts = None
    only_asks = True
    sentence = sdk.says("Wait until {condition:if}")

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return that it succeeds; only a condition that cannot be evaluated is a failure."""
        return sdk.ALWAYS_SUCCEEDS if sdk.is_simple(node) else sdk.ANY
