"""Modifiers that turn a result round."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.missions.modifiers.registry import Modifier, modifier
from rbxcompose.missions.statuses import FAILURE, SUCCESS
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


class Turning(Modifier):
    """Gives another result for some; the outcome's own name is then gone."""

    __slots__ = ("turned",)

    def __init__(self, site: Site, options: bool, inner: Task) -> None:
        super().__init__(site, options, inner)
        self.turned = self.turns() if options else {}

    @staticmethod
    def turns() -> dict[int, int]:
        """Return what becomes of which result."""
        raise NotImplementedError

    @staticmethod
    def read(reader: NodeReader, key: str) -> bool:
        """Read `true` or `false`."""
        return reader.flag(key)

    def begin(self) -> int:
        """Start the task inside."""
        return self.proceed()

    def proceed(self) -> int:
        """Go on, and turn the result."""
        status = self.advance(self.inner)
        turned = self.turned.get(status, status)
        if turned != status:
            self.engine.outcome = ""
        return turned


@modifier("optional")
class Optional(Turning):
    """Count a failure as success.

    Example:
        do:
          - go_to: corner_1
            optional: true
          - go_to: dock
    """

    __slots__ = ()

    @staticmethod
    def turns() -> dict[int, int]:
        """Return that a failure is a success."""
        return {FAILURE: SUCCESS}


@modifier("invert")
class Invert(Turning):
    """Turn success into failure, and failure into success.

    Example:
        do:
          - check: $battery < 20 %
            invert: true
          - go_to: corner_1
    """

    __slots__ = ()

    @staticmethod
    def turns() -> dict[int, int]:
        """Return that each is the other."""
        return {FAILURE: SUCCESS, SUCCESS: FAILURE}
