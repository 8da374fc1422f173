"""Where nodes with a history were when they were halted, so that they take up their place again."""

from __future__ import annotations

from typing import Protocol

NO_HISTORY, LAST, DEEP = "none", "last", "deep"
HISTORIES = (NO_HISTORY, LAST, DEEP)  # the default first


class ResumableTask(Protocol):
    """A task, as far as places know it."""

    number: int


class ResumePoints:
    """The tasks that will start again where they were.

    A task keeps its place if it has a history, or if one around it that is `deep` is being halted.
    """

    def __init__(self) -> None:
        self.kept: set[ResumableTask] = set()
        self.is_deep = False

    def leave(self, task: ResumableTask) -> None:
        """Note that a task is being halted."""
        if self.is_deep:
            self.kept.add(task)

    def take_up(self, task: ResumableTask) -> bool:
        """Return whether a task that starts has a place to start at; it is told once."""
        if task in self.kept:
            self.kept.remove(task)
            return True
        return False

    def forget(self, first: int, end: int) -> None:
        """Forget the places of all nodes from number `first` to `end` (exclusive)."""
        if self.kept:
            self.kept = {task for task in self.kept if not first <= task.number < end}
