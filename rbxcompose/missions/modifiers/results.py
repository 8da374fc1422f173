"""Modifiers that change a result."""

from __future__ import annotations

from typing import ClassVar

from rbxcompose.missions import sdk


class TurningTask(sdk.Decorator):
    """Replaces some results by others, and then drops the name of the outcome."""

    __slots__ = ("turned",)

    def __init__(self, site: sdk.Site, options: Turning, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.turned = options.turns if options.is_on else {}

    def begin(self) -> int:
        """Start the task inside."""
        return self.proceed()

    def proceed(self) -> int:
        """Continue, and replace the result."""
        status = self.advance(self.inner)
        turned = self.turned.get(status, status)
        if turned != status:
            self.engine.outcome = ""
        return turned


@sdk.dataclass(frozen=True, slots=True)
class Turning(sdk.Modifier):
    """A modifier that replaces results; it may be switched off."""

    is_on: bool = sdk.flag()

    may_skip = False
    value = None
    turns: ClassVar[dict[int, int]]  # replacements by result
    words: ClassVar[str]

    def clause(self) -> str:
        """Say what it replaces, if it is on."""
        return self.words if self.is_on else ""


class OptionalTask(TurningTask):
    """Keeps in mind whether its node failed, and whether it ever succeeded."""

    __slots__ = ("failed", "succeeded")
    saved = reported = ("failed", "succeeded")

    def __init__(self, site: sdk.Site, options: Optional, inner: sdk.Task) -> None:
        super().__init__(site, options, inner)
        self.failed = self.succeeded = False

    def advance(self, child: sdk.Task) -> int:
        """Start the child or continue with it, and keep in mind how it ended."""
        status = super().advance(child)
        if self.turned:
            self.failed |= status == sdk.FAILURE
            self.succeeded |= status == sdk.SUCCESS
        return status

    def only_failed(self) -> bool | None:
        """Return whether its node failed each time; None if it has not ended yet, or is not optional."""
        return not self.succeeded if self.failed or self.succeeded else None


@sdk.modifier("optional", OptionalTask)
class Optional(Turning):
    """Count a failure as success.

    Example:
        do:
          - go_to: corner_1
            optional: true
          - go_to: dock
    """

    __slots__ = ()
    turns = {sdk.FAILURE: sdk.SUCCESS}
    words = "a failure does not matter"

    def changed(self, inner: sdk.Outcomes) -> sdk.Outcomes:
        """Return the outcomes with failure as success."""
        if not self.is_on or not inner.counting_as(sdk.FAILS):
            return inner
        return inner.of(sdk.SUCCEEDS).both(sdk.ALWAYS_SUCCEEDS)

    @property
    def serves(self) -> sdk.ModifierScope:
        """Return the nodes that may fail."""
        return sdk.ModifierScope.FAILING if self.is_on else sdk.ModifierScope.ALL

    @property
    def forgives(self) -> bool:
        """Return true, even for one that could not be read: no finding blames the node then."""
        return True


@sdk.modifier("invert", TurningTask)
class Invert(Turning):
    """Swap success and failure.

    Example:
        do:
          - check: $battery < 20 %
            invert: true
          - go_to: corner_1
    """

    __slots__ = ()
    turns = {sdk.FAILURE: sdk.SUCCESS, sdk.SUCCESS: sdk.FAILURE}
    words = "success counts as failure, and failure as success"
    serves = sdk.ModifierScope.ALL

    def changed(self, inner: sdk.Outcomes) -> sdk.Outcomes:
        """Return the outcomes with success and failure swapped."""
        return sdk.Outcomes(inner.counting_as(sdk.FAILS), inner.counting_as(sdk.SUCCEEDS)) if self.is_on else inner
