"""Modifiers: settings that any mission node may have, each a task around the task of the node.

They are declared here from the outside in; that order holds whatever their order in the text.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from rbxcompose.expressions.evaluate import holds
from rbxcompose.expressions.tree import Expression
from rbxcompose.findings import Finding
from rbxcompose.missions import codes
from rbxcompose.missions.statuses import FAILURE, RUNNING, SKIPPED, SUCCESS
from rbxcompose.missions.task import Site, Task
from rbxcompose.units import TIME, format_quantity

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.views import View


class Modifier(Task):
    """A task around another one of the same node; what happens to the inner one happens to it."""

    __slots__ = ("inner",)

    def __init__(self, site: Site, options: object, inner: Task) -> None:
        super().__init__(site)
        self.inner = inner

    @staticmethod
    def read(reader: NodeReader, key: str) -> object:
        """Read the modifier's value, which becomes the `options` of its task."""
        raise NotImplementedError

    def suspend(self, anew: bool) -> bool:
        """Begin anew together with a leaf that begins anew."""
        if self.current is not None and self.inner.suspend(anew):
            self.current = None
            return True
        return False

    def proceed(self) -> int:
        """Go on with the task inside."""
        return self.advance(self.inner)


MODIFIERS: dict[str, type[Modifier]] = {}  # from the outside in
M = TypeVar("M", bound=type[Modifier])


def modifier(name: str) -> Callable[[M], M]:
    """Register a modifier under its key, inside of those registered before."""

    def register(cls: M) -> M:
        MODIFIERS[name] = cls
        return cls

    return register


@modifier("only_if")
class OnlyIf(Modifier):
    """Start only if the condition holds, else be skipped.

    Example:
        do:
          - go_to: dock
            only_if: $battery < 90 %
    """

    __slots__ = ("condition",)

    def __init__(self, site: Site, options: Expression, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.condition = options

    @staticmethod
    def read(reader: NodeReader, key: str) -> Expression:
        """Read a condition."""
        return reader.condition(key)

    def begin(self) -> int:
        """Ask the condition once."""
        return self.advance(self.inner) if holds(self.condition, self.scope) else SKIPPED


@modifier("optional")
class Optional(Modifier):
    """Count a failure as success.

    Example:
        do:
          - go_to: corner_1
            optional: true
          - go_to: dock
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
        """Start the task inside."""
        return self.proceed()

    def proceed(self) -> int:
        """Go on, and turn a failure round."""
        status = self.advance(self.inner)
        return SUCCESS if status == FAILURE and self.is_on else status


@modifier("timeout")
class Timeout(Modifier):
    """Fail when the node takes longer, all its attempts together; a result of the same instant is in time.

    Example:
        do:
          go_to: corner_1
          timeout: 30 s
    """

    __slots__ = ("allowed", "deadline", "duration")

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
    """How often a node is tried at most; None is for ever."""

    most: Expression | None


@modifier("attempts")
class Attempts(Modifier):
    """Try again after a failure, at the next tick.

    Example:
        do:
          go_to: corner_1
          attempts: 3
    """

    __slots__ = ("left", "most")

    def __init__(self, site: Site, options: Tries, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.most = options.most
        self.left = math.inf

    @staticmethod
    def read(reader: NodeReader, key: str) -> Tries:
        """Read a count or `forever`."""
        return Tries(reader.count_or_forever(key))

    @staticmethod
    def check(view: View) -> Iterator[Finding]:
        """What is tried for ever should wait somewhere."""
        tries = view.node.modifiers["attempts"]
        if isinstance(tries, Tries) and tries.most is None and not view.waits:
            help_text = "give it a number of attempts, or a 'wait' inside"
            yield codes.NEVER_WAITS.at(view.node.span, "what is tried for ever never waits", help=help_text)

    def begin(self) -> int:
        """Try for the first time."""
        self.left = math.inf if self.most is None else self.count_of(self.most, "'attempts'")
        return self.proceed()

    def proceed(self) -> int:
        """Go on with this attempt, or begin the next one."""
        status = self.advance(self.inner)
        if status != FAILURE:
            return status
        self.left -= 1
        if self.left < 1:
            return FAILURE
        self.engine.again(self)
        return RUNNING
