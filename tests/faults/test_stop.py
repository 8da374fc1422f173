"""A patrol that is stopped stays where it is until somebody releases it and sends it on its way again."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator

import pytest

from rbxcompose.runtime.log import NAME as LOG
from tests.faults.observer import MOTION
from tests.faults.patrol import LONGEST_STOP, SUPERVISOR, Patrol

STANDSTILL = 3.0  # [s]; longer than any process may be silent
WHOLE_COMMAND = 3.0  # [s] on a loaded machine
ODOMETRIES = 25  # as many as come in half a second


@pytest.fixture(scope="module")
def patrol(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Patrol]:
    """A robot that each test leaves on its way."""
    with Patrol(tmp_path_factory.mktemp("patrol"), times=100) as made:
        yield made


def test_after_a_stop_and_its_release_the_patrol_moves_only_when_it_is_told_to(patrol: Patrol) -> None:
    observer = patrol.observer

    def told_after(since: float) -> list[bool]:
        """Return whether the base was at rest, for each odometry since then."""
        return [
            velocity.is_rest for velocity in list(observer.story) if velocity.topic == MOTION and velocity.time > since
        ]

    assert observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up)
    patrol.do("stop")
    assert patrol.wait_for(lambda: told_after(0.0)[-1])
    stopped = time.monotonic()
    patrol.do("release")
    assert patrol.wait_for(lambda: len(told_after(stopped)) > ODOMETRIES)
    assert all(told_after(stopped))
    patrol.do("mission", "resume")
    assert observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up)
    assert patrol.unsafe() == []


def test_a_machine_that_slept_brakes_and_goes_on(patrol: Patrol) -> None:
    observer = patrol.observer
    assert observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up)
    processes = patrol.running()
    for process in processes:
        process.send_signal(signal.SIGSTOP)
    time.sleep(STANDSTILL)
    slept = time.monotonic()
    for process in processes:
        process.send_signal(signal.SIGCONT)
    assert patrol.wait_for(lambda: any(velocity.is_rest and velocity.time > slept for velocity in list(observer.story)))
    assert observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up)
    assert set(patrol.running()) == set(processes)
    assert "time stood still for " in (patrol.state.path / LOG).read_text(encoding="utf-8")


def test_a_stop_reaches_the_base_while_the_supervisor_is_suspended(patrol: Patrol) -> None:
    observer = patrol.observer
    assert observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up)
    supervisor = patrol.named(SUPERVISOR)
    assert supervisor is not None
    supervisor.send_signal(signal.SIGSTOP)
    asked = time.monotonic()
    told = patrol.do("stop")
    assert "stopped over the bus: mission, robot, world" in told
    assert "NOT" not in told
    assert patrol.wait_for(lambda: not observer.is_moving)
    assert time.monotonic() - asked < LONGEST_STOP + WHOLE_COMMAND
    supervisor.send_signal(signal.SIGCONT)
    log = patrol.state.path / LOG
    assert patrol.wait_for(lambda: "stop over the bus" in log.read_text(encoding="utf-8"))
    patrol.do("release")
    patrol.do("mission", "resume")
    assert observer.wait_until_it_moves(time.monotonic(), lambda: patrol.is_up)
