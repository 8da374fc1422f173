"""`end`: the mission is over."""

from __future__ import annotations

from rbxcompose.missions import sdk


class EndTask(sdk.Task):
    """Ends the run that it belongs to."""

    __slots__ = ("step",)

    def __init__(self, site: sdk.Site, step: EndStep) -> None:
        super().__init__(site)
        self.step = step

    def begin(self) -> int:
        """Request the end of the run, which takes effect at the end of this tick."""
        message = self.run.filled(self.step.message, self.scope) if self.step.message else ""
        status = sdk.SUCCESS if self.step.result == sdk.SUCCEEDS else sdk.FAILURE
        if self.run.ending is None or (status, self.run.ending) == (sdk.FAILURE, sdk.SUCCESS):
            self.run.ending, self.run.message = status, message
            if status == sdk.FAILURE:
                self.engine.reasons[self.number] = message or "the mission ended itself in failure"
        return sdk.RUNNING


@sdk.kind("end", EndTask)
@sdk.dataclass(frozen=True, slots=True)
class EndStep(sdk.Deed):
    """End the mission that contains this node, in `success` or `failure`; what runs is halted.

    If two branches of a parallel end it in one tick, failure beats success.

    Example:
        do:
          if: $battery < 10 %
          then:
            end: failure
            message: The battery has only $battery
          else:
            go_to: corner_1
    """

    result: str = sdk.choice(sdk.SUCCEEDS, sdk.FAILS)
    message: sdk.Template | None = sdk.text("A message for the log.", optional=True)

    may_end = sdk.ends(sdk.NEVER)

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the result, and the message."""
        return f"End in {self.result}{f': {sdk.spoken(self.message)}' if self.message else ''}"

    @property
    def ends_mission(self) -> str:
        """Return how the mission ends."""
        return self.result
