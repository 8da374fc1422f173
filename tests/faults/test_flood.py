"""Somebody floods the commands of the base with what is none: the patrol goes on, and everybody is told."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray
from rbxcompose.runtime.log import NAME as LOG
from rbxcompose.sdk.ports import Qos
from tests.conftest import ROOT
from tests.faults.observer import COMMAND, MOTION, Observer
from tests.faults.patrol import Patrol
from tests.forked import Forked
from tests.soak import Soak

FLOODER = str(Path(__file__).with_name("flooder.py"))
RATE = 175_000  # [Hz]; beyond what a machine can send, it sends what it can
QUICK, MANY = 1.5, 600  # [s]
FEW = 30  # [s] of tokens: each costs Zenoh as much as many messages, so that a longer flood takes the whole machine
ROUNDS = 300  # of the patrol, more than there is time for
LONGEST_GAP = 1.0  # [s] between two odometries, on a machine that has nothing left to give
TOLD = 0.8  # of the seconds at least, in each of which diagnostics report
MOVING = 0.8  # of the time at least


@pytest.fixture(scope="module")
def patrol(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Patrol]:
    """A robot that each flood leaves on its way."""
    with Patrol(tmp_path_factory.mktemp("patrol"), times=ROUNDS, hears_commands=False) as made:
        yield made


def lines_of(patrol: Patrol) -> int:
    """Return how long its log is."""
    return (patrol.state.path / LOG).read_text(encoding="utf-8").count("\n")


class Health:
    """Hears what diagnostics tell of the base, with the time [s]."""

    def __init__(self, observer: Observer) -> None:
        self.reports: list[float] = []
        self.refused: list[tuple[float, int]] = []
        observer.listen(
            "diagnostics_agg", DiagnosticArray, Qos.STATE, lambda one: self.reports.append(time.monotonic())
        )
        observer.listen("diagnostics", DiagnosticArray, Qos.STATE, self._take)

    def _take(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name == f"base: {COMMAND}" and "refused" in values:
                self.refused.append((time.monotonic(), int(values["refused"])))


@pytest.mark.timeout(MANY + 60)
def test_a_flood_is_refused_and_told_while_the_patrol_goes_on(soak: Soak, patrol: Patrol) -> None:
    seconds = MANY if soak.is_on else QUICK
    observer = patrol.observer
    health = Health(observer)
    assert observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up)
    before = set(patrol.running())
    words = [sys.executable, FLOODER, observer.router, COMMAND, str(RATE), str(seconds)]
    with Forked(words, env=patrol.environment, cwd=ROOT, stdout=subprocess.PIPE, text=True) as flooder:
        assert flooder.stdout is not None
        flooder.stdout.readline()  # it begins
        began = time.monotonic()
        sent = int(flooder.stdout.readline())
        ended = time.monotonic()
    motion = [
        velocity for velocity in list(observer.story) if velocity.topic == MOTION and began < velocity.time < ended
    ]
    assert patrol.wait_for(lambda: bool(health.refused) and health.refused[-1][0] > ended)
    assert set(patrol.running()) == before
    moving = sum(not velocity.is_rest for velocity in motion) / len(motion)
    gap = max(after.time - before.time for before, after in pairwise(motion))
    told = {number for at, number in health.refused if began < at}
    refused = max(told)
    text = (
        f"{sent / seconds:,.0f} a second were sent to a base, of which {refused / seconds:,.0f} arrived and were "
        f"refused; it moved for {moving:.0%} of the time, its odometry had gaps of at most {gap:.2f} s"
    )
    soak.tell("flood of commands", sent, 0, text)
    assert refused > 1000 * seconds, text
    assert len(told) >= max(1, TOLD * seconds - 1), f"diagnostics told of it {len(told)} times"
    assert sum(began < at < ended for at in health.reports) >= TOLD * seconds - 1, "nobody told how the robot is"
    assert gap < LONGEST_GAP, text
    assert moving > MOVING, text


@pytest.mark.timeout(MANY + 60)
@pytest.mark.parametrize("what", ["requests", "goals", "queries", "tokens"])
@pytest.mark.soak
def test_a_flood_of_questions_is_refused_while_the_patrol_goes_on(what: str, soak: Soak, patrol: Patrol) -> None:
    seconds = FEW if what == "tokens" else MANY
    observer, lines = patrol.observer, lines_of(patrol)
    assert observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up)
    before = set(patrol.running())
    words = [sys.executable, "-m", "tests.faults.asker", observer.router, what, str(seconds)]
    with subprocess.Popen(words, env=patrol.environment, cwd=ROOT, stdout=subprocess.PIPE, text=True) as asker:
        assert asker.stdout is not None
        asker.stdout.readline()  # it begins
        began = time.monotonic()
        asked = int(asker.stdout.readline())
        ended = time.monotonic()
        asker.communicate()
    motion = [
        velocity for velocity in list(observer.story) if velocity.topic == MOTION and began < velocity.time < ended
    ]
    assert set(patrol.running()) == before
    lines = lines_of(patrol) - lines
    moving = sum(not velocity.is_rest for velocity in motion) / len(motion)
    gap = max(after.time - before.time for before, after in pairwise(motion))
    text = f"{asked / seconds:,.0f} {what} a second; it moved for {moving:.0%} of the time, gaps of {gap:.2f} s at most"
    soak.tell(f"flood of {what}", asked, 0, text)
    assert asked > 300 * seconds, text
    assert gap < LONGEST_GAP, text
    assert moving > MOVING, text
    assert lines < 100 + 5 * seconds, f"{lines} lines of log"
