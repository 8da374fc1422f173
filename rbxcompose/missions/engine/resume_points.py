"""Where nodes with a history were halted, so that they can resume there."""

from typing import Protocol

NO_HISTORY, LAST, DEEP = "none", "last", "deep"
HISTORIES = (NO_HISTORY, LAST, DEEP)  # the default first


class ResumableTask(Protocol):
    """A task, as far as resume points know it."""

    number: int


class ResumePoints:
    """The tasks that will resume where they were halted.

    A task keeps its place if it has a history, or if a task around it with a `deep` history is being halted.
    """

    def __init__(self) -> None:
        self.kept: set[ResumableTask] = set()
        self.is_deep = False

    def leave(self, task: ResumableTask) -> None:
        """Note that a task is being halted."""
        if self.is_deep:
            self.kept.add(task)

    def take_up(self, task: ResumableTask) -> bool:
        """Return whether a task that starts has a place to resume at, and forget that place."""
        if task in self.kept:
            self.kept.remove(task)
            return True
        return False

    def forget(self, first: int, end: int) -> None:
        """Forget the places of all nodes from number `first` to `end` (exclusive)."""
        if self.kept:
            self.kept = {task for task in self.kept if not first <= task.number < end}
