"""The twin of a chore: it takes its time and returns to rest."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import AT_REST, Velocity2
from rbxcompose.domains.bases.components.chore_sim import ChoreCore, ChoreSimConfig

DT = 0.05  # [s]
TIMES = st.floats(0.0, 20.0)
SETTINGS = st.builds(
    ChoreSimConfig, speed=st.floats(0.0, 0.5), turn_rate=st.floats(-1.5, 1.5), stroke=st.floats(0.05, 5.0)
)


def velocities(settings: ChoreSimConfig, duration: float) -> list[Velocity2]:
    """Return the velocity of each step of `DT` until the chore is done."""
    core, found = ChoreCore(settings), []
    core.start(duration)
    while not core.is_done:
        found.append(core.step(DT))
    assert core.step(DT) == AT_REST
    return found


@given(SETTINGS, TIMES)
def test_it_takes_its_time_and_not_a_step_more(settings: ChoreSimConfig, duration: float) -> None:
    taken = len(velocities(settings, duration)) * DT
    assert duration - 1e-6 <= taken < duration + DT + 1e-6


@given(SETTINGS, TIMES)
def test_it_never_exceeds_what_is_set(settings: ChoreSimConfig, duration: float) -> None:
    for velocity in velocities(settings, duration):
        assert abs(velocity.linear) <= settings.speed
        assert velocity.angular == settings.turn_rate


@given(st.integers(1, 8), st.integers(1, 20))
def test_an_even_number_of_strokes_ends_where_it_began(pairs: int, steps: int) -> None:
    settings = ChoreSimConfig(speed=0.05, stroke=steps * DT)
    way = sum(velocity.linear * DT for velocity in velocities(settings, 2 * pairs * steps * DT))
    assert way == pytest.approx(0.0, abs=1e-9)


def test_each_chore_begins_with_a_stroke_forwards() -> None:
    core = ChoreCore(ChoreSimConfig(speed=0.1, stroke=1.0))
    core.start(5.0)
    for _ in range(int(1.5 / DT)):
        last = core.step(DT)
    assert last.linear == -0.1
    core.start(5.0)
    assert core.step(DT).linear == 0.1
