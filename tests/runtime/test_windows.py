"""Windows of a component with a thread of its own: the bus is touched by the scheduler's thread only."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rbxcompose.missions.execution.requests import ListMissions
from rbxcompose.runtime.process_group.worker import HandedOver


class Later:
    """A worker whose calls wait for the scheduler's thread, and the context behind it."""

    clock: Any = None

    def __init__(self) -> None:
        self.waiting: list[Callable[[], None]] = []
        self.opened: list[tuple[str, str]] = []
        self.news: list[object] = []
        self.is_watched = False

    def send(self, call: Callable[[], None]) -> None:
        self.waiting.append(call)

    def turn(self) -> None:
        while self.waiting:
            self.waiting.pop(0)()

    def window(self, path: str, question: str) -> Any:
        self.opened.append((path, question))
        return self

    def put(self, value: object, /) -> None:
        self.news.append(value)


def test_it_is_opened_and_used_by_the_schedulers_thread() -> None:
    later: Any = Later()
    window = HandedOver(later, later).window("map", ListMissions())
    later.is_watched = True
    assert not window.is_watched
    window.put(1)
    assert (later.opened, later.news) == ([], [])
    later.turn()
    assert (later.opened, later.news) == ([("map", ListMissions())], [1])
    assert window.is_watched
