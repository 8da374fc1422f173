"""Steps that rest while there is no goal: at the same instants as those that never rest."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.scheduler import Scheduler
from rbxcompose.runtime.process_group.provided import GoalSteps

PERIOD = 0.05


def _nothing() -> None: ...


class Server:
    """Has a goal, or none."""

    def __init__(self, current: object = None) -> None:
        self.current = current
        self.began: Callable[[], None] = _nothing

    def begin(self) -> None:
        self.current = object()
        self.began()

    def end(self) -> None:
        self.current = None


def _run(scheduler: Scheduler, until: float) -> None:
    while (due := scheduler.next_due()) is not None and due <= until:
        scheduler.advance(due)
    scheduler.advance(until)


def test_nothing_is_due_without_a_goal() -> None:
    scheduler = Scheduler()
    GoalSteps(scheduler, "arm", PERIOD, lambda dt: None, [Server()])
    assert scheduler.next_due() is None


def test_there_is_one_more_step_after_the_goal() -> None:
    scheduler, server = Scheduler(), Server()
    seen: list[bool] = []
    GoalSteps(scheduler, "arm", PERIOD, lambda dt: seen.append(server.current is not None), [server])
    scheduler.at(0.12, "arm", server.begin)
    scheduler.at(0.23, "arm", server.end)
    _run(scheduler, 1.0)
    assert seen == [True, True, False]
    assert scheduler.next_due() is None


def test_a_goal_that_is_there_already_counts() -> None:
    scheduler = Scheduler()
    steps: list[float] = []
    GoalSteps(scheduler, "arm", PERIOD, steps.append, [Server(current="a goal")])
    _run(scheduler, 3.5 * PERIOD)
    assert len(steps) == 3


@given(st.lists(st.tuples(st.integers(0, 40), st.integers(1, 20)), max_size=5))
def test_steps_with_a_goal_are_those_of_a_component_that_never_rests(goals: list[tuple[int, int]]) -> None:
    scheduler, server = Scheduler(), Server()
    always: list[tuple[float, float]] = []
    resting: list[tuple[float, float]] = []

    def note(steps: list[tuple[float, float]], dt: float) -> None:
        if server.current is not None:
            steps.append((round(scheduler.now, 6), round(dt, 6)))

    scheduler.every(PERIOD, "arm", lambda dt: note(always, dt))
    GoalSteps(scheduler, "arm", PERIOD, lambda dt: note(resting, dt), [server])
    for begins, lasts in goals:
        scheduler.at(begins * PERIOD / 2, "server", server.begin)
        scheduler.at((begins + lasts) * PERIOD / 2, "server", server.end)
    _run(scheduler, 2.0)
    assert resting == always
