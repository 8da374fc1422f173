"""Modifiers that cut a node short, or try it again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbxcompose.expressions.evaluate import holds
from rbxcompose.expressions.tree import Expression
from rbxcompose.missions import codes
from rbxcompose.missions.modifiers.registry import Modifier, modifier
from rbxcompose.missions.statuses import FAILURE, RUNNING
from rbxcompose.missions.task import Site, Task
from rbxcompose.missions.watching import Watched
from rbxcompose.units import TIME, format_quantity

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


@modifier("as_long_as")
class AsLongAs(Modifier):
    """Fail as soon as the condition does not hold; what runs is halted.

    Example:
        do:
          go_to: corner_1
          as_long_as: $battery > 20 %
    """

    __slots__ = ("watched",)

    def __init__(self, site: Site, options: Expression, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.watched = Watched.of(options)

    @staticmethod
    def read(reader: NodeReader, key: str) -> Expression:
        """Read a condition."""
        return reader.condition(key)

    def begin(self) -> int:
        """Ask for the first time."""
        return self.proceed()

    def proceed(self) -> int:
        """Ask, then go on."""
        if not holds(self.watched.condition, self.scope):
            self.engine.halt(self, f"not as long as {self.watched.condition.text}")
            return FAILURE
        status = self.advance(self.inner)
        if status == RUNNING:
            self.engine.watch(self.watched)
        return status


@modifier("timeout")
class Timeout(Modifier):
    """Fail when the node takes longer, all its attempts together; a result of the same instant is in time.

    Example:
        do:
          go_to: corner_1
          timeout: 30 s
    """

    __slots__ = ("allowed", "deadline", "duration")
    saved = ("allowed", "deadline")

    def __init__(self, site: Site, options: Expression, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.duration = options
        self.allowed = 0.0  # [s]
        self.deadline = 0.0

    @staticmethod
    def read(reader: NodeReader, key: str) -> Expression:
        """Read a duration."""
        return reader.duration(key)

    def begin(self) -> int:
        """Set the deadline."""
        self.allowed = self.number_of(self.duration, "a timeout")
        self.deadline = self.engine.time + self.allowed
        return self.proceed()

    def proceed(self) -> int:
        """Go on, unless the deadline has come."""
        status = self.advance(self.inner)
        if status != RUNNING or not self.engine.is_due(self.deadline):
            return status
        self.engine.halt(self, f"timeout of {format_quantity(self.allowed, TIME)}")
        return FAILURE


@dataclass(frozen=True, slots=True)
class Tries:
    """How often a node is tried at most (None: for ever), how long each try may take, the pause between two."""

    most: Expression | None
    timeout: Expression | None = None
    pause: Expression | None = None


@modifier("attempts")
class Attempts(Modifier):
    """Try again after a failure, at the next tick or after a pause.

    Example:
        do:
          go_to: corner_1
          attempts: 3
          attempt_timeout: 20 s
          attempt_pause: 2 s
    """

    __slots__ = ("deadline", "is_between", "left", "tries")
    saved = ("deadline", "is_between", "left")
    keys = {
        "attempt_timeout": "How long each attempt may take.",
        "attempt_pause": "The time between an attempt that failed and the next one.",
    }

    def __init__(self, site: Site, options: Tries, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.tries = options
        self.left = math.inf
        self.deadline = 0.0  # of this attempt, or of the pause [s]
        self.is_between = False

    @staticmethod
    def read(reader: NodeReader, key: str) -> Tries:
        """Read a count or `forever`, and what belongs to it."""
        timeout, pause = (
            reader.duration(one) if reader.has(one) else None for one in ("attempt_timeout", "attempt_pause")
        )
        if not reader.has(key):
            one = "attempt_timeout" if timeout else "attempt_pause"
            reader.add(codes.MISSING.at(reader.key_span(one), f"'{one}' needs 'attempts': how often it is tried"))
            return Tries(None, timeout, pause)
        return Tries(reader.count_or_forever(key), timeout, pause)

    def begin(self) -> int:
        """Try for the first time."""
        self.left = math.inf if self.tries.most is None else self.count_of(self.tries.most, "'attempts'")
        self._begin_attempt()
        return self.proceed()

    def proceed(self) -> int:
        """Go on with this attempt, or begin the next one."""
        if self.is_between:
            if not self.engine.is_due(self.deadline):
                return RUNNING
            self._begin_attempt()
        status = self.advance(self.inner)
        if status == RUNNING and self.tries.timeout and self.engine.is_due(self.deadline):
            self.engine.halt(self, "timeout of an attempt")
            status = FAILURE
        if status != FAILURE:
            return status
        self.left -= 1
        if self.left < 1:
            return FAILURE
        self.is_between = True
        self.deadline = self.engine.time + self._seconds(self.tries.pause, "'attempt_pause'")
        if self.engine.is_due(self.deadline):
            self.engine.again(self)
        return RUNNING

    def _begin_attempt(self) -> None:
        self.is_between = False
        self.deadline = self.engine.time + self._seconds(self.tries.timeout, "'attempt_timeout'")

    def _seconds(self, expression: Expression | None, what: str) -> float:
        return 0.0 if expression is None else self.number_of(expression, what)
