"""Modifiers that decide whether a node starts; if not, it is skipped."""

from __future__ import annotations

from typing import ClassVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import holds
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.fields import condition, duration, flag
from rbxcompose.missions.modifiers.registry import Decorator, modifier
from rbxcompose.missions.program.answers import ModifierScope
from rbxcompose.missions.program.modifier import Skipping
from rbxcompose.missions.program.outcomes import RUNNING, SKIPPED


class ConditionalTask(Decorator):
    """Evaluates a condition once, before the node starts."""

    __slots__ = ("condition",)
    skips_if: ClassVar[bool]

    def __init__(self, site: Site, options: Conditional, inner: Task) -> None:
        super().__init__(site, inner)
        self.condition = options.value

    def begin(self) -> int:
        """Evaluate the condition once."""
        return SKIPPED if holds(self.condition, self.scope) == self.skips_if else self.advance(self.inner)


class OnlyIfTask(ConditionalTask):
    """Continues if the condition holds."""

    __slots__ = ()
    skips_if = False


class SkipIfTask(ConditionalTask):
    """Continues if the condition does not hold."""

    __slots__ = ()
    skips_if = True


@dataclass(frozen=True, slots=True)
class Conditional(Skipping):
    """A modifier with a condition."""

    value: Expression = condition()

    serves = ModifierScope.ALL


@modifier("only_if", OnlyIfTask)
class OnlyIf(Conditional):
    """Start only if the condition holds, else be skipped.

    Example:
        do:
          - go_to: dock
            only_if: $battery < 90 %
    """

    __slots__ = ()


@modifier("skip_if", SkipIfTask)
class SkipIf(Conditional):
    """Be skipped if the condition holds.

    Example:
        do:
          - go_to: dock
            skip_if: distance($pose, dock) < 20 cm
    """

    __slots__ = ()


class CountingTask(Decorator):
    """Records when its node ended within this run of the mission; a halt is no end."""

    __slots__ = ("ended_at", "ended_in")
    saved = ("ended_at", "ended_in")
    times = ("ended_at",)

    def __init__(self, site: Site, inner: Task) -> None:
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
        if status not in (RUNNING, SKIPPED):
            self.ended_at, self.ended_in = self.engine.unpaused, self.run.begun
        return status


class OnceTask(CountingTask):
    """Skips its node once it has ended."""

    __slots__ = ("is_on",)

    def __init__(self, site: Site, options: Once, inner: Task) -> None:
        super().__init__(site, inner)
        self.is_on = options.is_on

    def begin(self) -> int:
        """Start if it has not ended yet."""
        return SKIPPED if self.is_on and self.has_ended else self.proceed()


@modifier("once", OnceTask)
@dataclass(frozen=True, slots=True)
class Once(Skipping):
    """Run once per run of the mission, whether it succeeds or fails; then be skipped.

    Example:
        do:
          repeat: 3
          do:
            - log: The patrol begins
              once: true
            - go_to: corner_1
    """

    is_on: bool = flag()

    value = None

    @property
    def serves(self) -> ModifierScope:
        """Return the nodes that are repeated."""
        return ModifierScope.REPEATED if self.is_on else ModifierScope.ALL


class CooldownTask(CountingTask):
    """Skips its node for a time after it has ended."""

    __slots__ = ("duration",)

    def __init__(self, site: Site, options: Cooldown, inner: Task) -> None:
        super().__init__(site, inner)
        self.duration = options.value

    def begin(self) -> int:
        """Start if that time has passed, or if the node has not ended yet."""
        is_cooling = self.has_ended and not self.engine.has_gone_by(self._seconds(), self.ended_at)
        return SKIPPED if is_cooling else self.proceed()

    def _seconds(self) -> float:
        return self.number_of(self.duration, "'cooldown'")


@modifier("cooldown", CooldownTask)
@dataclass(frozen=True, slots=True)
class Cooldown(Skipping):
    """Be skipped for a time after it ends; interrupts count towards it, pauses do not.

    Example:
        do:
          repeat: 3
          do:
            - recharge:
              cooldown: 10 min
            - go_to: corner_1
    """

    value: Expression = duration()

    serves = ModifierScope.REPEATED
