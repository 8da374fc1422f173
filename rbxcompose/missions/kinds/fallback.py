"""`fallback`: one node after the other, until one succeeds."""

from collections.abc import Iterator

from rbxcompose.missions import sdk


class FallbackTask(sdk.InTurnTask):
    """A list that ends at the first success."""

    __slots__ = ()
    decides = sdk.SUCCESS


@sdk.kind("fallback", FallbackTask)
class FallbackStep(sdk.InTurn):
    """Try the nodes of a list in order, until one succeeds; skipped ones are passed over.

    Example:
        do:
          fallback:
            - check: distance($pose, dock) < 15 cm
            - go_to: dock
    """

    __slots__ = ()
    decides = sdk.SUCCEEDS
    flow = sdk.NodeFlow.FIRST
    look = sdk.NodeLook("?")
    sentence = sdk.says("Try {in_order}, until one succeeds")

    @property
    def goes_on_after(self) -> str:
        """Return failure."""
        return "" if self.order == sdk.RANDOM else sdk.FAILS

    def possibilities(
        self, node: sdk.MissionNode, nodes: tuple[sdk.MissionNode, ...], robot: sdk.RobotNames
    ) -> Iterator[sdk.Possibility]:
        """Yield each node but the first, which is always tried."""
        for index, child in enumerate(node.children[1:], 2):
            yield sdk.Possibility(nodes[child].span, f"{node.path}: alternative {index}", sdk.started(child))
