"""Promises of joints that slide."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.controllers.linear import LinearMove, LinearPolicy

POLICY = LinearPolicy(0.05, 0.01)
PLACES = st.floats(0.0, 0.4)


def moved(policy: LinearPolicy, wanted: float, position: float, dt: float) -> tuple[LinearMove, list[float]]:
    """Return a move that is over, and where the joint was after each step."""
    move, at = LinearMove(policy, wanted, position, 0.0), [position]
    for index in range(int(20.0 / dt)):
        at.append(at[-1] + move.step(at[-1], index * dt, dt) * dt)
        if move.is_over:
            break
    return move, at


@given(PLACES, PLACES, st.sampled_from([0.01, 0.05, 0.1]), st.none() | st.floats(0.05, 2.0))
def test_it_arrives_at_most_as_fast_as_it_may_without_turning_back(
    wanted: float, position: float, dt: float, acceleration: float | None
) -> None:
    policy = LinearPolicy(0.05, 0.01, acceleration=acceleration)
    move, at = moved(policy, wanted, position, dt)
    assert move.is_over
    assert move.failure == ""
    assert abs(at[-1] - wanted) <= policy.dead_band
    if abs(wanted - position) > policy.dead_band:
        assert abs(at[-1] - wanted) <= 0.1 * 0.05 * dt + 1e-9  # it went on to where it should be
    steps = [new - old for old, new in itertools.pairwise(at)]
    assert all(abs(step) <= 0.05 * dt + 1e-9 for step in steps)
    assert all(step * (wanted - position) >= 0.0 for step in steps)


def test_within_the_dead_band_it_does_not_move() -> None:
    move, at = moved(POLICY, 0.2, 0.195, 0.01)
    assert (move.is_over, len(at), at[-1]) == (True, 2, 0.195)


def test_a_joint_that_is_stuck_fails_and_says_where() -> None:
    move = LinearMove(POLICY, 0.2, 0.1, 0.0)
    assert move.step(0.1, 1.9, 0.1) == 0.05
    assert move.step(0.1, 2.0, 0.1) == 0.0
    assert move.failure == "it has not moved for 2 s, 0.1 m before its goal"


@pytest.mark.parametrize("policy", [(0.0, 0.01), (0.05, math.nan), (0.05, 0.0), (math.inf, 0.01)])
def test_what_cannot_be_is_refused(policy: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="must be positive and finite"):
        LinearPolicy(*policy)
