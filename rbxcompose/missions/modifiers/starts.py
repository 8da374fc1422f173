"""Modifiers around the start of a node: the hooks of states, and what decides whether a node starts."""

from __future__ import annotations

from typing import ClassVar

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


class ConditionalTask(sdk.Decorator):
    """Evaluates a condition once, before the node starts."""

    __slots__ = ("condition", "skips_if")

    def __init__(self, site: sdk.Site, options: Conditional, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.condition, self.skips_if = options.value, options.skips_if

    def begin(self) -> int:
        """Evaluate the condition once."""
        return sdk.SKIPPED if sdk.holds(self.condition, self.scope) == self.skips_if else self.advance(self.inner)


@sdk.dataclass(frozen=True, slots=True)
class Conditional(sdk.Skipping):
    """A modifier with a condition."""

    value: sdk.Expression = sdk.condition()

    serves = sdk.ModifierScope.ALL
    skips_if: ClassVar[bool]


@sdk.modifier("only_if", ConditionalTask)
class OnlyIf(Conditional):
    """Start only if the condition holds, else be skipped.

    Example:
        do:
          - go_to: dock
            only_if: $battery < 90 %
    """

    __slots__ = ()
    skips_if = False
    clause = sdk.says("only if {value:if}")


@sdk.modifier("skip_if", ConditionalTask)
class SkipIf(Conditional):
    """Be skipped if the condition holds.

    Example:
        do:
          - go_to: dock
            skip_if: distance($pose, dock) < 20 cm
    """

    __slots__ = ()
    skips_if = True
    clause = sdk.says("not if {value:if}")


class CountingTask(sdk.Decorator):
    """Records when its node ended within this run of the mission; a halt is no end."""

    __slots__ = ("ended_at", "ended_in")
    saved = ("ended_at", "ended_in")
    times = ("ended_at",)

    def __init__(self, site: sdk.Site, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.ended_at = 0.0  # [s] of robot time without pauses
        self.ended_in = 0  # the run of the mission, counted from 1

    @property
    def has_ended(self) -> bool:
        """Return whether the node has ended in this run of the mission."""
        return self.ended_in == self.run.begun

    def proceed(self) -> int:
        """Continue, and note when it ends."""
        status = self.advance(self.inner)
        if status not in (sdk.RUNNING, sdk.SKIPPED):
            self.ended_at, self.ended_in = self.engine.unpaused, self.run.begun
        return status


class OnceTask(CountingTask):
    """Skips its node once it has ended."""

    __slots__ = ("is_on",)

    def __init__(self, site: sdk.Site, options: Once, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.is_on = options.is_on

    def begin(self) -> int:
        """Start if it has not ended yet."""
        return sdk.SKIPPED if self.is_on and self.has_ended else self.proceed()


@sdk.modifier("once", OnceTask)
@sdk.dataclass(frozen=True, slots=True)
class Once(sdk.Skipping):
    """Run once per run of the mission, whether it succeeds or fails; then be skipped.

    Example:
        do:
          repeat: 3
          do:
            - log: The patrol begins
              once: true
            - go_to: corner_1
    """

    is_on: bool = sdk.flag()

    value = None

    def clause(self) -> str:
        """Say it, if it is on."""
        return "only once" if self.is_on else ""

    @property
    def serves(self) -> sdk.ModifierScope:
        """Return the nodes that are repeated."""
        return sdk.ModifierScope.REPEATED if self.is_on else sdk.ModifierScope.ALL


class CooldownTask(CountingTask):
    """Skips its node for a time after it has ended."""

    __slots__ = ("duration",)

    def __init__(self, site: sdk.Site, options: Cooldown, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.duration = options.value

    def begin(self) -> int:
        """Start if that time has passed, or if the node has not ended yet."""
        is_cooling = self.has_ended and not self.engine.has_gone_by(
            self.number_of(self.duration, "'cooldown'"), self.ended_at
        )
        return sdk.SKIPPED if is_cooling else self.proceed()


@sdk.modifier("cooldown", CooldownTask)
@sdk.dataclass(frozen=True, slots=True)
class Cooldown(sdk.Skipping):
    """Be skipped for a time after it ends; interrupts count towards it, pauses do not.

    Example:
        do:
          repeat: 3
          do:
            - recharge:
              cooldown: 10 min
            - go_to: corner_1
    """

    value: sdk.Expression = sdk.duration()

    serves = sdk.ModifierScope.REPEATED
    clause = sdk.says("not again within {value}")
