"""Processes that plan for an arm: what they plan is what is planned here, and whatever happens to them stays theirs."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest

from rbxcompose.base.clock import MonotonicClock, SteppedClock
from rbxcompose.domains.arms.motion import hand_task as ways_ahead
from rbxcompose.domains.arms.motion.hand_task import PlanJob, Planned
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionRequest
from rbxcompose.domains.arms.planning_processes import PlanningProcess, planning_processes
from rbxcompose.domains.arms.reasons import MotionFailure
from rbxcompose.runtime.processes import Process, wait_until_ended
from tests.motion.pi_hand import made
from tests.motion.test_ways_ahead import CONFINED, cluttered, outcome, planning
from tests.motion.toy_arm import ended
from tests.soak import Soak, rare

pytestmark = pytest.mark.timeout(100)  # each takes seconds to start
TIMELESS = float  # a clock that stands still: so many positions are the limit, on any machine
TIME = 0.2  # [s], in which helpers are asked, and answer first
SCENES = (CONFINED, 175, 727)  # in which motions are hard to find, or are not found
ORPHAN = """
import os, pickle, signal, sys
from rbxcompose.domains.arms.planning_processes import PlanningProcess
one = PlanningProcess(pickle.load(sys.stdin.buffer), print, float)
print(one.pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def started(warned: list[str], time: float = TIME) -> PlanningProcess:
    """Start a process that plans for a time [s]."""
    config = made()[0]
    short = config.model_copy(update={"planner": config.planner.model_copy(update={"time": time})})
    return PlanningProcess(short, warned.append, TIMELESS)


@cache
def alone() -> object:
    """Return how a goal of the confined scene ends without helpers."""
    return outcome(CONFINED, (), TIME)


def wait_for(process: PlanningProcess) -> None:
    """Wait until it can begin a job."""
    process.wait()
    assert process.is_idle


@pytest.fixture(autouse=True)
def _asked_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ways_ahead, "ALONE", 0)


@pytest.fixture
def warned() -> list[str]:
    return []


@pytest.fixture(scope="module")
def pair_warned() -> list[str]:
    return []


@pytest.fixture(scope="module")
def both(pair_warned: list[str], soak: Soak) -> Iterator[list[PlanningProcess]]:
    """Return processes that nothing happens to: two, where a test asks both."""
    both = [started(pair_warned) for _ in range(soak.examples(1, 2))]
    yield both
    for process in both:
        process.close()


@pytest.fixture
def pair(both: list[PlanningProcess]) -> list[PlanningProcess]:
    """Return them when they can begin a job: one that still answers what was abandoned is not asked."""
    for process in both:
        wait_for(process)
    return both


@pytest.mark.parametrize("seed_and_helpers", [(CONFINED, 2), *rare((CONFINED, 1), *product(SCENES[1:], (1, 2)))])
@pytest.mark.soak
def test_one_two_and_three_processes_come_to_the_same(
    pair: list[PlanningProcess], pair_warned: list[str], seed_and_helpers: tuple[int, int]
) -> None:
    seed, helpers = seed_and_helpers
    assert outcome(seed, pair[:helpers], TIME) == (alone() if seed == CONFINED else outcome(seed, (), TIME))
    assert pair_warned == []


def test_what_a_process_plans_is_what_is_planned_here(pair: list[PlanningProcess]) -> None:
    kinds = set()
    for seed in (CONFINED, SCENES[-1]):
        bench = cluttered(seed)
        works = bench.works
        free = [sample for sample in works.space.samples(400, seed) if works.planner.checker.is_free(sample)]
        with planning(bench, (), TIME):
            for start, goal in pairwise(free[:3]):
                job = PlanJob(MotionRequest(start, goal), {}, works.objects, works.paddings)
                pair[0].begin(job)
                works.kinematics.place({})
                here = ended(works.planner.plan(job.request))
                assert content(answer(pair[0], job)) == content(here)
                kinds.add(type(here))
    assert kinds == {MotionPlan, MotionFailure}


def content(planned: Planned) -> object:
    """Return all that there is in it."""
    if isinstance(planned, MotionFailure):
        return planned
    assert planned.trajectory is not None
    times, *others = (getattr(planned.trajectory, name).tolist() for name in ("times", "positions", "velocities"))
    return times, others, planned.waypoints.tolist(), planned.attempts, planned.examined, planned.found_by


def answer(process: PlanningProcess, job: PlanJob) -> Planned:
    """Return what was planned, once it is."""
    process.wait()
    found = process.answer(job)
    assert found is not None
    return found


@pytest.mark.soak
def test_a_goal_goes_on_without_those_that_are_killed_or_hang(pair: list[PlanningProcess], warned: list[str]) -> None:
    lost = [started(warned) for _ in range(2)]
    for process, number in zip(lost, (signal.SIGKILL, signal.SIGSTOP), strict=True):
        wait_for(process)
        os.kill(process.pid, number)
    assert outcome(CONFINED, [*lost, pair[1]], TIME) == alone()
    lost[1].patience = 0.0
    assert outcome(CONFINED, lost, TIME) == alone()
    for process in lost:
        assert not process.is_idle
        process.close()
    assert warned == [
        f"a process that plans for 'right_arm' {told}: there is one less until the arm starts again"
        for told in ("is gone", "does not answer")
    ]


def test_what_is_abandoned_is_not_planned_to_the_end(warned: list[str]) -> None:
    endless = started(warned, time=1e9)
    wait_for(endless)
    works, measured = cluttered(CONFINED).works, cluttered(CONFINED).measured
    start = np.array([measured[name][0] for name in works.space.names])
    there = next(sample for sample in works.space.samples(400, 1) if works.planner.checker.is_free(sample))
    job = PlanJob(MotionRequest(start, there), {}, works.objects, works.paddings)
    endless.begin(job)
    assert not endless.is_idle
    endless.abandon()
    wait_for(endless)
    assert endless.answer(job) is None
    endless.close()
    assert warned == []


def test_none_is_left_when_the_process_of_the_arm_is_killed() -> None:
    config = pickle.dumps(made()[0])
    done = subprocess.run([sys.executable, "-c", ORPHAN], input=config, stdout=subprocess.PIPE, check=False)
    assert done.returncode == -signal.SIGKILL
    try:
        left = [Process.of(int(done.stdout))]
    except ProcessLookupError:
        left = []
    assert wait_until_ended(left, 30.0) == []


def test_there_is_none_where_time_is_stepped_and_no_more_than_the_machine_has(
    warned: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = made()[0]
    many = config.model_copy(update={"planner": config.planner.model_copy(update={"processes": 4})})
    assert planning_processes(many, SteppedClock(), warned.append) == ()
    assert planning_processes(config, MonotonicClock(), warned.append) == ()
    assert planning_processes(many.model_copy(update={"hand": None}), MonotonicClock(), warned.append) == ()
    assert warned == []
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0})
    assert planning_processes(many, MonotonicClock(), warned.append) == ()
    assert "4" in warned[0]
