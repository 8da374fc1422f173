"""Hooks: what is set, logged or published when a node starts or ends."""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.missions import sdk

ON_START, ON_SUCCESS, ON_FAILURE, ON_HALT = "on_start", "on_success", "on_failure", "on_halt"
_ON: Mapping[int, str] = {sdk.SUCCESS: ON_SUCCESS, sdk.FAILURE: ON_FAILURE}


class HooksTask(sdk.Decorator):
    """Runs the hooks when its node starts, ends or is halted."""

    __slots__ = ("moments",)

    def __init__(self, site: sdk.Site, options: Hooks, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.moments = options.moments

    def begin(self) -> int:
        """Run the hook of the start, and start."""
        sdk.act(self.moments, ON_START, self)
        return self.proceed()

    def proceed(self) -> int:
        """Continue, and run the hook of the result at the end."""
        status = self.advance(self.inner)
        if status in _ON:
            sdk.act(self.moments, _ON[status], self)
        return status

    def halt(self) -> None:
        """Stop the node, and run the hook of a halt."""
        super().halt()
        sdk.act_safely(self.moments, ON_HALT, self)

    def suspend(self, from_start: bool) -> bool:
        """Suspend the node; if it is to start again, that is a halt."""
        starts_over = super().suspend(from_start)
        if starts_over:
            sdk.act_safely(self.moments, ON_HALT, self)
        return starts_over


@sdk.modifier(ON_START, HooksTask)
class Hooks(sdk.Acting):
    """Act when the node starts or ends: `set`, `log` or `publish`.

    They run once per node, not per attempt, and see its result before `optional` and `invert`.

    Example:
        data:
          missed: 0
        do:
          go_to: corner_1
          on_start:
            log: Going to the first corner
          on_failure:
            set:
              missed: $missed + 1
    """

    on_start = sdk.hook()
    on_success = sdk.hook("What is set, logged or published when the node succeeds.")
    on_failure = sdk.hook("What is set, logged or published when the node fails.")
    on_halt = sdk.hook("What is set, logged or published when the node is halted.")
