"""A process that gets no processor is told, but not ended for it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.runtime import channel as say
from tests.runtime.stage import Stage


def test_a_process_that_waits_for_a_processor_is_told_but_not_ended_until_it_had_one() -> None:
    stage = Stage().start()
    stage.beats.discard("robot")
    for tenth in range(100):
        stage.waited["robot"] = 0.09 * tenth
        stage.pass_time(0.1)
    (cause,) = {order.cause for _, order in stage.sent if isinstance(order, say.Lost)}
    assert cause == "process 'robot' waited 0.5 s for a processor: this machine has too much to do"
    assert stage.killed == []
    stage.pass_time(2.0)
    assert stage.killed == ["robot"]


@given(share=st.floats(0.0, 0.95))
def test_a_process_that_hangs_on_a_loaded_machine_is_ended_once_it_had_its_time(share: float) -> None:
    stage = Stage().start()
    stage.beats.discard("robot")
    began = stage.scheduler.now
    while not stage.killed:
        stage.waited["robot"] = share * (stage.scheduler.now - began)
        stage.pass_time(0.1)
        assert stage.scheduler.now - began < 2.0 / (1.0 - share) + 1.5


@pytest.mark.parametrize(
    ("waited", "reason"),
    [
        (0.0, "time stood still for 3.2 s: the machine slept, or the supervisor was suspended"),
        (2.9, "the supervisor waited 2.9 s for a processor: this machine has too much to do"),
    ],
)
def test_the_log_tells_why_a_supervisor_was_held_up(waited: float, reason: str) -> None:
    stage = Stage().start()
    stage.pass_time(1.0)
    stage.waited[None] = waited
    stage.scheduler.advance(stage.scheduler.now + 3.0)
    assert stage.records[-1] == (Level.WARN, reason)
