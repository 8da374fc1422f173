"""The scheduler: an order that never depends on chance."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.scheduler import Scheduler


def test_events_run_by_time_then_owner_then_sequence() -> None:
    scheduler, ran = Scheduler(), list[str]()
    scheduler.at(2.0, "a", lambda: ran.append("a at 2"))
    scheduler.at(1.0, "b", lambda: ran.append("b at 1"))
    scheduler.at(1.0, "a", lambda: ran.append("a at 1, first"))
    scheduler.at(1.0, "a", lambda: ran.append("a at 1, second"))
    scheduler.advance(2.0)
    assert ran == ["a at 1, first", "a at 1, second", "b at 1", "a at 2"]


def test_what_is_posted_by_an_event_runs_at_the_same_instant() -> None:
    scheduler, ran = Scheduler(), list[float]()

    def post() -> None:
        scheduler.post("b", lambda: ran.append(scheduler.now))

    scheduler.at(1.0, "a", post)
    scheduler.advance(1.0)
    assert ran == [1.0]


def test_a_timer_keeps_its_grid_and_skips_cycles_that_were_missed() -> None:
    scheduler, steps = Scheduler(), list[float]()
    timer = scheduler.every(0.1, "a", steps.append)
    scheduler.advance(0.1)
    scheduler.advance(0.55)  # late: the cycles at 0.2, 0.3, 0.4 are gone
    assert scheduler.next_due() == pytest.approx(0.6)
    assert timer.missed == 3
    assert steps == pytest.approx([0.1, 0.2])  # the second dt is cut to two periods


def test_a_cancelled_timer_and_a_removed_owner_run_no_more() -> None:
    scheduler, ran = Scheduler(), list[str]()
    timer = scheduler.every(0.1, "a", lambda dt: ran.append("a"))
    scheduler.every(0.1, "b", lambda dt: ran.append("b"))
    timer.cancel()
    scheduler.remove("b")
    scheduler.advance(1.0)
    assert ran == []
    assert scheduler.next_due() is None


def test_a_callback_that_raises_is_told_with_its_owner_and_others_go_on() -> None:
    failures, ran = list[tuple[str, str]](), list[str]()

    def fail() -> None:
        raise ValueError("broken")

    scheduler = Scheduler(on_error=lambda owner, error: failures.append((owner, str(error))))
    scheduler.at(1.0, "a", fail)
    scheduler.at(1.0, "b", lambda: ran.append("b"))
    scheduler.advance(1.0)
    assert failures == [("a", "broken")]
    assert ran == ["b"]


def test_events_that_never_end_at_one_instant_are_a_fault() -> None:
    scheduler = Scheduler()

    def again() -> None:
        scheduler.post("a", again)

    again()
    with pytest.raises(RuntimeError, match="events at"):
        scheduler.advance(0.0)


@given(st.lists(st.tuples(st.integers(0, 5), st.sampled_from("abc")), max_size=30), st.integers(0, 5))
def test_the_order_does_not_depend_on_how_time_is_advanced(events: list[tuple[int, str]], split: int) -> None:
    def run(stops: list[float]) -> list[tuple[float, str, int]]:
        scheduler, ran = Scheduler(), list[tuple[float, str, int]]()
        for number, (time, owner) in enumerate(events):
            scheduler.at(time, owner, lambda event=(time, owner, number): ran.append(event))  # type: ignore[misc]
        for stop in stops:
            scheduler.advance(stop)
        return ran

    assert run([split, 5.0]) == run([5.0]) == sorted(run([5.0]))
