from __future__ import annotations

from collections.abc import Callable
from threading import Thread

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.local import Inbox


@given(depth=st.integers(1, 5), items=st.lists(st.integers(), max_size=20))
def test_the_newest_are_kept_in_order_and_the_others_counted(depth: int, items: list[int]) -> None:
    scheduler, handled = Scheduler(), list[int]()
    inbox = Inbox("a", depth, handled.append, scheduler.post)
    for item in items:
        inbox.put(item, scheduler.post)
    scheduler.advance(0.0)
    assert handled == items[-depth:]
    assert inbox.dropped == len(items) - len(handled)


def test_however_much_comes_the_scheduler_is_woken_once() -> None:
    woken: list[tuple[str, Callable[[], None]]] = []
    inbox = Inbox[int]("a", 10, lambda item: None, Scheduler().post)
    for item in range(5):
        inbox.put(item, lambda owner, callback: woken.append((owner, callback)))
    assert [owner for owner, _ in woken] == ["a"]


def test_who_is_patient_is_woken_once_so_many_items_wait_and_may_take_them_before() -> None:
    scheduler, handled = Scheduler(), list[int]()
    inbox = Inbox("a", 10, handled.append, scheduler.post)
    for item in (1, 2):
        inbox.put(item, scheduler.post, at=3)
    scheduler.advance(0.0)
    assert handled == []
    inbox.take_all()
    assert (handled, inbox.dropped) == ([1, 2], 0)
    for item in (3, 4, 5):
        inbox.put(item, scheduler.post, at=3)
    scheduler.advance(0.0)
    assert handled == [1, 2, 3, 4, 5]


def test_a_full_inbox_takes_turns_with_the_others() -> None:
    scheduler, handled = Scheduler(), list[str]()
    busy = Inbox("a", 10, handled.append, scheduler.post)
    quiet = Inbox("a", 10, handled.append, scheduler.post)
    for item in ("busy 1", "busy 2", "busy 3"):
        busy.put(item, scheduler.post)
    quiet.put("quiet", scheduler.post)
    scheduler.advance(0.0)
    assert handled == ["busy 1", "quiet", "busy 2", "busy 3"]


def test_a_handler_that_raises_loses_only_its_own_item() -> None:
    handled: list[int] = []

    def handle(item: int) -> None:
        if item == 1:
            raise ValueError("one")
        handled.append(item)

    scheduler = Scheduler(on_error=lambda owner, error: None)
    inbox = Inbox("a", 10, handle, scheduler.post)
    for item in (0, 1, 2):
        inbox.put(item, scheduler.post)
    scheduler.advance(0.0)
    assert handled == [0, 2]


def test_after_closing_nothing_is_handled_and_what_waited_is_given_back() -> None:
    scheduler = Scheduler()
    inbox = Inbox[int]("a", 10, lambda item: pytest.fail("it was handled"), scheduler.post)
    inbox.put(1, scheduler.post)
    assert inbox.close() == [1]
    inbox.put(2, scheduler.post)
    scheduler.advance(0.0)


def test_several_threads_lose_nothing() -> None:
    scheduler, handled = Scheduler(), list[int]()
    inbox = Inbox("a", None, handled.append, scheduler.post)
    woken: list[Callable[[], None]] = []

    def fill() -> None:
        for item in range(500):
            inbox.put(item, lambda _, callback: woken.append(callback))

    threads = [Thread(target=fill) for _ in range(4)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads) or woken:
        if woken:
            scheduler.post("a", woken.pop())
        scheduler.advance(0.0)
    assert sorted(handled) == sorted([*range(500)] * 4)
    assert inbox.dropped == 0
