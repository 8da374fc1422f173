"""`check`: does a condition hold now?"""

from __future__ import annotations

from rbxcompose.missions import sdk
from rbxcompose.missions.sdk import FAILURE, SUCCESS, holds  # looked up in every tick


class CheckTask(sdk.Task):
    """Evaluates the condition once."""

    __slots__ = ("condition",)

    def __init__(self, site: sdk.Site, step: CheckStep) -> None:
        super().__init__(site)
        self.condition = step.condition

    def begin(self) -> int:
        """Evaluate the condition."""
        return SUCCESS if holds(self.condition, self.scope) else FAILURE


@sdk.kind("check", CheckTask)
@sdk.dataclass(frozen=True, slots=True)
class CheckStep(sdk.LeafStep):
    """Succeed if the condition holds, else fail.

    Example:
        do:
          - check: $battery > 20 %
          - go_to: corner_1
    """

    condition: sdk.Expression = sdk.condition()

    waits = False
    has_result = False
    lasts = None
    only_asks = True

    may_end = sdk.ends(sdk.ANY)
    sentence = sdk.says("Check that {condition:if}")
