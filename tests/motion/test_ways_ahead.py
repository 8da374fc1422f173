"""Who plans to the next ways changes nothing but the time: neither ways, motions nor reasons, whatever helpers do."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion import fast_search, search
from rbxcompose.domains.arms.motion import hand_task as ways_ahead
from rbxcompose.domains.arms.motion.hand_task import ContactSearch, HandTask, PlanJob, Planned, PlanningHelper
from rbxcompose.domains.arms.motion.planner import MotionPlanner, MotionRequest, Planning
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason
from rbxcompose.domains.body.model import Geometry
from rbxcompose.msgs.rbxcompose_msgs import PickObject
from tests.motion.pi_hand import HandBench

PICK = PickObject.Goal(object="target")
ATTEMPTS = 3  # ways that are planned to
SHORT = 0.02  # [s] of planning: on a clock that stands still it is a number of positions, which is often too small
CONFINED = 664  # the seed of a scene that the arm gets nowhere in
Outcome = tuple[object, ...]
NEVER = MotionFailure(MotionReason.UNKNOWN_GOAL, "nobody asks for this motion if there are no helpers")


def cluttered(seed: int) -> HandBench:
    """Return an arm somewhere among random boxes."""
    chance = random.Random(seed)
    boxes = [_box(f"b{index}", chance) for index in range(chance.randint(4, 14))]
    bench = HandBench(*boxes)
    space, checker = bench.works.space, bench.works.planner.checker
    start = next((sample for sample in space.samples(60, seed) if checker.is_free(sample)), np.zeros(len(space.joints)))
    bench.measured.update({name: (at, 0.0) for name, at in zip(space.names, start.tolist(), strict=True)})
    return bench


def _box(name: str, chance: random.Random) -> PlacedObject:
    size = [chance.choice((0.01, chance.uniform(0.05, 0.3))) for _ in range(3)]
    at = (chance.uniform(-0.1, 0.4), chance.uniform(-0.45, 0.25), chance.uniform(0.5, 1.15))
    return PlacedObject(name, Geometry("box", tuple(size)), "base_footprint", Transform3(at))


@contextmanager
def planning(bench: HandBench, helpers: Sequence[PlanningHelper], time: float = SHORT) -> Iterator[None]:
    """Plan with helpers, for a time [s]."""
    works, before = bench.works, bench.works.planner.settings
    works.helpers, works.planner.settings = helpers, replace(before, time=time)
    try:
        yield
    finally:
        works.helpers, works.planner.settings = (), before


def outcome(seed: int, helpers: Sequence[PlanningHelper], time: float = SHORT) -> Outcome:
    """Return how a pick ends, and where the arm is then."""
    bench = cluttered(seed)
    with planning(bench, helpers, time):
        task = bench.carried_out(PICK)
    assert isinstance(task, HandTask)
    return task.failure, tuple(bench.stages), tuple(bench.openings), tuple(bench.measured.items())


class Recalling:
    """A helper that knows what was planned without helpers, and tells it after a while, or is gone by then."""

    def __init__(self, known: dict[bytes, Planned], waits: Sequence[int | None]) -> None:
        self._known, self._waits, self._left = known, iter(waits), 0
        self.given: list[PlanJob] = []
        self.job: PlanJob | None = None

    @property
    def is_idle(self) -> bool:
        return self.job is None

    def begin(self, job: PlanJob) -> None:
        assert self.is_idle
        wait = next(self._waits, 0)
        self.job, self._left = job, 10**9 if wait is None else wait
        self.given.append(job)

    def answer(self, job: PlanJob) -> Planned | None:
        assert job is self.job
        self._left -= 1
        if self._left >= 0:
            return None
        self.job = None
        return self._known.get(job.request.goal.tobytes(), NEVER)

    def abandon(self) -> None:
        self.job = None


@pytest.fixture
def known(monkeypatch: pytest.MonkeyPatch) -> dict[bytes, Planned]:
    """Note all motions that are planned, by their ends; slices are small, so that there are many in a short time."""
    monkeypatch.setattr(ways_ahead, "ALONE", 0)
    monkeypatch.setattr(ways_ahead, "ATTEMPTS", ATTEMPTS)
    for one in (fast_search, search):
        monkeypatch.setattr(one, "SLICE", 100)
    noted: dict[bytes, Planned] = {}
    plan = MotionPlanner.plan

    def noting(planner: MotionPlanner, request: MotionRequest) -> Planning:
        found = yield from plan(planner, request)
        noted[request.goal.tobytes()] = found
        return found

    monkeypatch.setattr(MotionPlanner, "plan", noting)
    return noted


_CONFINED: dict[bytes, Planned] = {}


@cache
def _outcome_of_confined() -> Outcome:
    return outcome(CONFINED, ())


@pytest.fixture
def alone(known: dict[bytes, Planned]) -> Outcome:
    """Return how a pick ends in the confined scene without helpers, whose motions are noted."""
    found = _outcome_of_confined()
    if known:
        _CONFINED.update(known)
    known.update(_CONFINED)
    return found


WAITS = st.lists(st.one_of(st.none(), st.integers(0, 12)), max_size=4)


@pytest.mark.timeout(200)
@pytest.mark.soak
@settings(max_examples=2, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.one_of(st.just(CONFINED), st.integers(0, 10_000)), st.lists(WAITS, min_size=1, max_size=3))
def test_a_goal_ends_with_helpers_as_it_does_without(
    known: dict[bytes, Planned], seed: int, waits: list[list[int | None]]
) -> None:
    known.clear()
    alone = outcome(seed, ())
    helpers = [Recalling(dict(known), numbers) for numbers in waits]
    assert outcome(seed, helpers) == alone
    assert all(helper.is_idle for helper in helpers)


def test_helpers_plan_to_all_ways_but_the_first_and_never_twice_to_the_same(
    known: dict[bytes, Planned], alone: Outcome
) -> None:
    assert len(known) == ATTEMPTS
    before = dict(known)
    helpers = [Recalling(before, ()) for _ in range(4)]
    known.clear()
    assert outcome(CONFINED, helpers) == alone
    assert len(known) == 1  # was planned here
    given = [job.request.goal.tobytes() for helper in helpers for job in helper.given]
    assert sorted(given) == sorted(before.keys() - known.keys())


def test_without_helpers_no_way_is_looked_for_before_it_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ways_ahead, "ALONE", 0)
    looked, find = list[object](), ContactSearch.next_way

    def noting(*given: Any) -> Any:
        looked.append(given)
        return find(*given)

    monkeypatch.setattr(ContactSearch, "next_way", noting)
    bench = HandBench()
    with planning(bench, (), 5.0):
        assert bench.carried_out(PICK).failure is None
    assert len(looked) == 1


def test_an_easy_goal_asks_nobody() -> None:
    bench, helper = HandBench(), Recalling({}, ())
    with planning(bench, [helper], 5.0):
        assert bench.carried_out(PICK).failure is None
    assert helper.given == []


def test_a_goal_that_is_cancelled_lets_all_helpers_go(known: dict[bytes, Planned]) -> None:
    bench = cluttered(CONFINED)
    helpers = [Cancelling(bench), Cancelling(bench)]
    with planning(bench, helpers):
        task = bench.carried_out(PICK)
    assert helpers[0].given
    assert task.failure is not None
    assert task.failure.reason is MotionReason.INTERRUPTED
    assert all(helper.is_idle for helper in helpers)


@pytest.mark.timeout(100)
def test_what_was_planned_among_other_objects_or_from_elsewhere_does_not_count(
    known: dict[bytes, Planned], alone: Outcome
) -> None:
    for change in ("scene", "start"):
        bench = cluttered(CONFINED)
        wrong: dict[bytes, Planned] = dict.fromkeys(known, NEVER)
        helper = Changing(wrong, bench, change)
        with planning(bench, [helper]):
            task = bench.carried_out(PICK)
        assert helper.given
        assert task.failure is not None
        assert task.failure.reason is not NEVER.reason
        if change == "scene":
            assert task.failure == alone[0]


class Cancelling(Recalling):
    """A helper that never answers, and during whose planning the goal is cancelled."""

    def __init__(self, bench: HandBench) -> None:
        super().__init__({}, (None,))
        self._bench = bench

    def begin(self, job: PlanJob) -> None:
        super().begin(job)
        self._bench.task.cancel()


class Changing(Recalling):
    """A helper during whose planning something changes: its answers are wrong. It is asked a few times."""

    def __init__(self, known: dict[bytes, Planned], bench: HandBench, change: str) -> None:
        super().__init__(known, ())
        self._bench, self._change = bench, change

    @property
    def is_idle(self) -> bool:
        return super().is_idle and len(self.given) < 3

    def begin(self, job: PlanJob) -> None:
        super().begin(job)
        bench, name = self._bench, self._bench.works.space.names[0]
        if self._change == "start":
            bench.measured[name] = (bench.measured[name][0] + 0.02, 0.0)
        else:
            name = f"far_{len(self.given)}"
            bench.scene.add(PlacedObject(name, Geometry("sphere", (0.01,)), "base_footprint", Transform3((5.0, 0, 0))))
            bench.works.place_objects(bench.objects)
