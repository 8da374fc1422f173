"""`wait`: let time pass."""

from __future__ import annotations

from rbxcompose.missions import sdk


class WaitTask(sdk.Task):
    """Has a deadline."""

    __slots__ = ("deadline", "duration")
    saved = times = fresh = ("deadline",)

    def __init__(self, site: sdk.Site, step: WaitStep) -> None:
        super().__init__(site)
        self.duration = step.lasts
        self.deadline = 0.0

    def begin(self) -> int:
        """Set the deadline."""
        self.deadline = self.engine.time + self.number_of(self.duration, "a duration")
        return self.proceed()

    def proceed(self) -> int:
        """Succeed once the deadline has come."""
        return sdk.SUCCESS if self.engine.is_due(self.deadline) else sdk.RUNNING


@sdk.kind("wait", WaitTask)
@sdk.dataclass(frozen=True, slots=True)
class WaitStep(sdk.LeafStep):
    """Succeed after a time; after an interrupt, only the rest of it remains.

    Example:
        do:
          - wait: 5 s
          - go_to: corner_1
    """

    lasts: sdk.Expression = sdk.duration(least=0, counted="a wait")

    waits = True
    has_result = False
    only_asks = False
    sentence = sdk.says("Wait {lasts}")

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return that it always succeeds if the duration is a literal."""
        return sdk.ALWAYS_SUCCEEDS if isinstance(self.lasts.tree, sdk.Number) else sdk.ANY
