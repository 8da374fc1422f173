"""Modifiers that decide whether a node starts at all; one that does not is skipped."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import holds
from rbxcompose.expressions.tree import Expression
from rbxcompose.missions.modifiers.registry import Modifier, modifier
from rbxcompose.missions.statuses import RUNNING, SKIPPED
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


class Conditional(Modifier):
    """Reads a condition, which is asked once, before the node starts."""

    __slots__ = ("condition",)

    def __init__(self, site: Site, options: Expression, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.condition = options

    @staticmethod
    def read(reader: NodeReader, key: str) -> Expression:
        """Read a condition."""
        return reader.condition(key)


@modifier("only_if")
class OnlyIf(Conditional):
    """Start only if the condition holds, else be skipped.

    Example:
        do:
          - go_to: dock
            only_if: $battery < 90 %
    """

    __slots__ = ()

    def begin(self) -> int:
        """Ask the condition once."""
        return self.advance(self.inner) if holds(self.condition, self.scope) else SKIPPED


@modifier("skip_if")
class SkipIf(Conditional):
    """Be skipped if the condition holds.

    Example:
        do:
          - go_to: dock
            skip_if: distance($pose, dock) < 20 cm
    """

    __slots__ = ()

    def begin(self) -> int:
        """Ask the condition once."""
        return SKIPPED if holds(self.condition, self.scope) else self.advance(self.inner)


class Counting(Modifier):
    """Knows when its node ended within this run of the mission; a halt is no end."""

    __slots__ = ("ended_at", "ended_in")
    saved = ("ended_at", "ended_in")

    def __init__(self, site: Site, options: object, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.ended_at = 0.0  # [s] of robot time without pauses
        self.ended_in = 0  # the run of the mission, counted from 1

    @property
    def has_ended(self) -> bool:
        """Tell whether the node has ended in this run of the mission."""
        return self.ended_in == self.run.begun

    def proceed(self) -> int:
        """Go on, and note when it ends."""
        status = self.advance(self.inner)
        if status not in (RUNNING, SKIPPED):
            self.ended_at, self.ended_in = self.engine.unpaused, self.run.begun
        return status


@modifier("once")
class Once(Counting):
    """Be done once within a run of the mission, whether it succeeds or fails; then be skipped.

    Example:
        do:
          repeat: 3
          do:
            - log: The patrol begins
              once: true
            - go_to: corner_1
    """

    __slots__ = ("is_on",)

    def __init__(self, site: Site, options: bool, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.is_on = options

    @staticmethod
    def read(reader: NodeReader, key: str) -> bool:
        """Read `true` or `false`."""
        return reader.flag(key)

    def begin(self) -> int:
        """Start if it has not ended yet."""
        return SKIPPED if self.is_on and self.has_ended else self.proceed()


@modifier("cooldown")
class Cooldown(Counting):
    """Be skipped for a time after it has ended; the time of interrupts counts, that of pauses does not.

    Example:
        do:
          repeat: 3
          do:
            - recharge:
              cooldown: 10 min
            - go_to: corner_1
    """

    __slots__ = ("duration",)

    def __init__(self, site: Site, options: Expression, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.duration = options

    @staticmethod
    def read(reader: NodeReader, key: str) -> Expression:
        """Read a duration."""
        return reader.duration(key)

    def begin(self) -> int:
        """Start if that time has gone by, or if it has not ended yet."""
        is_cooling = self.has_ended and not self.engine.has_gone_by(self._seconds(), self.ended_at)
        return SKIPPED if is_cooling else self.proceed()

    def _seconds(self) -> float:
        return self.number_of(self.duration, "'cooldown'")
