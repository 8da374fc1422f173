"""`on_enter` and `on_exit` of states."""

from __future__ import annotations

from rbxcompose.missions import sdk

ON_ENTER, ON_EXIT = "on_enter", "on_exit"


class EnteringTask(sdk.Decorator):
    """Runs the hooks when a state is entered and left."""

    __slots__ = ("moments",)

    def __init__(self, site: sdk.Site, options: Entering, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.moments = options.moments

    def begin(self) -> int:
        """Run the hook of entering, and start."""
        sdk.act(self.moments, ON_ENTER, self)
        return self.proceed()

    def proceed(self) -> int:
        """Continue, and run the hook of leaving at the end."""
        status = self.advance(self.inner)
        if status != sdk.RUNNING:
            sdk.act(self.moments, ON_EXIT, self)
        return status

    def suspend(self, from_start: bool) -> bool:
        """Suspend the body: an interrupt halts leaves, not states; the state stays entered, its body starts again."""
        if self.current is not None and self.inner.suspend(from_start):
            self.current = None
        return False

    def halt(self) -> None:
        """Stop the body, and run the hook of leaving unless the whole mission is ended from outside."""
        super().halt()
        if not self.engine.is_aborting:
            sdk.act_safely(self.moments, ON_EXIT, self)


@sdk.modifier(ON_ENTER, EnteringTask, only_states=True)
class Entering(sdk.Acting):
    """Act when a state is entered and left: `set`, `log` or `publish`.

    A state is also left when something inside the mission halts it, and also entered when its history brings the
    machine back to it.

    Example:
        machine:
          start: away
          states:
            away:
              do:
                go_to: corner_1
              on_enter:
                log: Off we go
              on_exit:
                log: That was it
              next:
                success: finished
                failure: failed
    """

    on_enter = sdk.hook()
    on_exit = sdk.hook("What is set, logged or published when the state is left.")
