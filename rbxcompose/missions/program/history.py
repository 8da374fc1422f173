"""What kinds with the option `history` share: they resume where they were halted."""

from __future__ import annotations

from typing import ClassVar

from rbxcompose.missions.engine.resume_points import DEEP, NO_HISTORY
from rbxcompose.missions.engine.task import Task


class WithHistory(Task):
    """A task that may have a history; kinds set `history` and call `engine.places.take_up` when they begin."""

    __slots__ = ("history",)
    history: str
    is_kept_after_failure: ClassVar[bool] = False

    def halt(self) -> None:
        """Stop what runs, and keep the place."""
        places = self.engine.places
        before, places.is_deep = places.is_deep, places.is_deep or self.history == DEEP
        if self.history != NO_HISTORY:
            places.kept.add(self)
        super().halt()
        places.is_deep = before

    def forget_places(self) -> None:
        """Forget the places of this node and those below it, since it has ended."""
        if self.history != NO_HISTORY:
            self.engine.places.forget(self.number, self.end)
