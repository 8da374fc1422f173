"""`sequence`: one node after the other, until one fails."""

from rbxcompose.missions import sdk


class SequenceTask(sdk.InTurnTask):
    """A list that ends at the first failure."""

    __slots__ = ()
    decides = sdk.FAILURE
    is_kept_after_failure = True


@sdk.kind("sequence", SequenceTask)
class SequenceStep(sdk.InTurn):
    """Do the nodes of a list in order, until one fails.

    Example:
        do:
          sequence:                       # a bare list is one too
            - go_to: dock
            - recharge
    """

    __slots__ = ()
    decides = sdk.FAILS
    flow = sdk.NodeFlow.IN_TURN
    look = sdk.NodeLook("→")
    sentence = sdk.says("Do {in_order}")

    @property
    def goes_on_after(self) -> str:
        """Return success."""
        return "" if self.order == sdk.RANDOM else sdk.SUCCEEDS
