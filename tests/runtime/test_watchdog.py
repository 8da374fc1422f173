from __future__ import annotations

import socket
import sys
from itertools import count
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime.channel import Channel, Start
from rbxcompose.runtime.folder import RunOptions
from rbxcompose.runtime.process_group.connection import HANG, PERIOD, Watchdog
from rbxcompose.runtime.process_group.group import ProcessGroup
from rbxcompose.testing import Bench, instance

MODULE = "rbxcompose.runtime.process_group.connection"


class EndedError(Exception):
    """Raised instead of the end of the process."""


def watched(monkeypatch: pytest.MonkeyPatch, share: float, fed: int = 0, place: str = "") -> tuple[int, bytes]:
    """Return after how many wake-ups it ends a process that waits for a processor for a `share` of the time, and how.

    Its loop feeds it in the first `fed` of them, and is at a `place` now.
    """
    dog, slept, looked, told = Watchdog(lambda: place), count(1), count(), list[bytes]()
    dog._thread = object()  # type: ignore[assignment]

    def sleep(seconds: float) -> None:
        assert seconds == PERIOD
        if next(slept) <= fed:
            dog.feed()

    def end(status: int) -> None:
        raise EndedError

    monkeypatch.setattr(f"{MODULE}.waits_of", lambda pid: {"1": 7.0 + share * PERIOD * next(looked)})
    monkeypatch.setattr(f"{MODULE}.faulthandler.dump_traceback", lambda file: None)
    monkeypatch.setattr(sys.stderr, "flush", lambda: None)
    # In its module alone: other threads of the tests sleep and write, too.
    monkeypatch.setattr(f"{MODULE}.time", SimpleNamespace(sleep=sleep))
    system = SimpleNamespace(getpid=lambda: 0, write=lambda descriptor, text: told.append(text), _exit=end)
    monkeypatch.setattr(f"{MODULE}.os", system)
    with pytest.raises(EndedError):
        dog._watch()
    return next(slept) - 1, b"".join(told)


def periods(monkeypatch: pytest.MonkeyPatch, share: float, fed: int = 0) -> int:
    return watched(monkeypatch, share, fed)[0]


@pytest.mark.parametrize(("place", "told"), [("", b"2 s\n"), ("step of 'lidar'", b"2 s in step of 'lidar'\n")])
def test_it_says_where_the_process_hangs(monkeypatch: pytest.MonkeyPatch, place: str, told: bytes) -> None:
    assert watched(monkeypatch, 0.0, place=place)[1] == b"the loop did not run for " + told


def test_it_ends_a_process_whose_loop_does_not_run(monkeypatch: pytest.MonkeyPatch) -> None:
    assert periods(monkeypatch, 0.0) == HANG / PERIOD


def test_time_in_which_the_process_waits_for_a_processor_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    assert 3 * HANG / PERIOD < periods(monkeypatch, 0.75) <= 4 * HANG / PERIOD


def test_it_lives_for_as_long_as_it_is_fed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert periods(monkeypatch, 0.0, fed=100) in (100 + HANG / PERIOD - 1, 100 + HANG / PERIOD)


@pytest.mark.parametrize(("is_stepped", "bounds"), [(False, [HANG, HANG]), (True, [60.0, 30.0])])
def test_a_hang_ends_the_process_on_a_stepped_clock_too_but_only_after_what_a_call_may_take(
    monkeypatch: pytest.MonkeyPatch, is_stepped: bool, bounds: list[float]
) -> None:
    fed: list[float] = []
    monkeypatch.setattr(Watchdog, "feed", lambda dog, seconds: fed.append(seconds))
    ours, theirs = socket.socketpair()
    monkeypatch.setattr("rbxcompose.runtime.process_group.group.gc", Mock())
    bench = Bench(instance("battery", "battery_sim", {"runtime": "45 s"}), start=False)
    plan = Plan("robot", "robot.yaml", bench.plan.instances)
    options, process = RunOptions(is_stepped=is_stepped), plan.groups[0]
    with ours, theirs:
        group = ProcessGroup(plan, process, options, None, Channel(ours), start=0.0)  # type: ignore[arg-type]
        group.beat()
        group._host = bench.host
        group.handle(Start())  # a step may hang before the next beat
    assert fed == bounds
