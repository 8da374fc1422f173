"""What kinds with the option `history` share: they resume where they were halted."""

from __future__ import annotations

from typing import ClassVar

from rbxcompose.missions.engine.resume_points import DEEP, HISTORIES, NO_HISTORY
from rbxcompose.missions.engine.task import Task
from rbxcompose.missions.language.node_reader import NodeReader

HISTORY = "Where it restarts after it was halted: `last` at the child it was in, `deep` also inside that child."


def read_history(reader: NodeReader) -> str:
    """Read the option; `none` if it is absent."""
    return reader.choice("history", HISTORIES)


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
