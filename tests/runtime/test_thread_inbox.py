from __future__ import annotations

import os
import select
import threading

import pytest

from rbxcompose.base.scheduler import Scheduler
from rbxcompose.runtime.process_group.connection import CallbackInbox


def is_readable(inbox: CallbackInbox) -> bool:
    return bool(select.select([inbox], [], [], 0.0)[0])


def test_it_wakes_who_waits_and_runs_in_the_order_of_arrival() -> None:
    inbox, scheduler, ran = CallbackInbox(), Scheduler(), list[int]()
    assert not is_readable(inbox)
    for number in range(3):
        inbox.put("x", lambda number=number: ran.append(number))  # type: ignore[misc]
    assert is_readable(inbox)
    inbox.drain(scheduler)
    assert not is_readable(inbox)
    assert ran == []
    scheduler.advance(0.0)
    assert ran == [0, 1, 2]
    inbox.close()


@pytest.mark.parametrize("threads", [1, 4])
def test_nothing_is_lost_between_threads(threads: int) -> None:
    inbox, scheduler, each = CallbackInbox(), Scheduler(), 2000
    ran: list[int] = []

    def fill() -> None:
        for number in range(each):
            inbox.put("x", lambda number=number: ran.append(number))  # type: ignore[misc]

    workers = [threading.Thread(target=fill) for _ in range(threads)]
    for worker in workers:
        worker.start()
    while len(ran) < threads * each:
        assert select.select([inbox], [], [], 10.0)[0], "a wake-up was lost"
        inbox.drain(scheduler)
        scheduler.advance(0.0)
    for worker in workers:
        worker.join()
    inbox.close()


def test_a_signal_written_after_the_other_was_heard_is_read_as_well() -> None:
    inbox, scheduler, ran = CallbackInbox(), Scheduler(), list[int]()
    inbox.put("x", lambda: ran.append(1))
    inbox.drain(scheduler)
    os.eventfd_write(inbox.fileno(), 1)  # of a thread that had looked at the flag before the first signal
    inbox.drain(scheduler)
    assert not is_readable(inbox), "the process would turn without end"
    inbox.close()
