"""Backing up and turning on the spot."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from rbxcompose.base.geometry import Pose2, Velocity2
from rbxcompose.domains.navigation.costs import CostSettings, CostZone, LayeredCosts
from rbxcompose.domains.navigation.manoeuvres import BackUpManoeuvre, Manoeuvre, ManoeuvreState, SpinManoeuvre
from tests.navigation.houses import room

ALL_AROUND = CostZone("carpet", ((-2.5, -2.5), (2.5, -2.5), (2.5, 2.5), (-2.5, 2.5)))
HOLE = CostZone("stairs", ((-1.1, -1.0), (-0.9, -1.0), (-0.9, 1.0), (-1.1, 1.0)))
WALL = (-1.1, -1.0, -0.9, 1.0)


def end_of(manoeuvre: Manoeuvre, costs: LayeredCosts | None, share: float = 1.0) -> tuple[Pose2, ManoeuvreState, float]:
    """Carry it out with a base that does a share of what it is told; return where, how and when [s] that ends."""
    pose, state, time = Pose2(), ManoeuvreState.MOVES, 0.0
    while state is ManoeuvreState.MOVES and time < 100.0:
        velocity, state = manoeuvre.update(pose, costs, 0.05)
        pose, time = pose.moved(Velocity2(share * velocity.linear, share * velocity.angular), 0.05), time + 0.05
    return pose, state, time


def test_a_robot_leaves_a_zone_backwards_but_never_touches_a_wall_or_another_zone_there() -> None:
    def x_after(*walls: tuple[float, float, float, float], zones: list[CostZone]) -> tuple[float, ManoeuvreState]:
        costs = LayeredCosts(room(*walls), CostSettings(radius=0.2), zones)
        pose, state, _ = end_of(BackUpManoeuvre(1.0, 0.1), costs)
        return pose.x, state

    x, state = x_after(zones=[ALL_AROUND])
    assert (round(x, 1), state) == (-1.0, ManoeuvreState.DONE)
    for walls, zones in (([WALL], [ALL_AROUND]), ([], [ALL_AROUND, HOLE]), ([WALL], [])):
        x, state = x_after(*walls, zones=zones)
        assert state is ManoeuvreState.BLOCKED
        assert -0.7 <= x < -0.4


@pytest.mark.parametrize("manoeuvre", [lambda: BackUpManoeuvre(1.0, 0.1), lambda: SpinManoeuvre(math.pi, 1.0, 1.5)])
@pytest.mark.parametrize(
    ("share", "end", "least", "most"),
    [
        (0.0, ManoeuvreState.STUCK, 5.0, 10.0),
        (0.05, ManoeuvreState.STUCK, 15.0, 60.0),
        (0.3, ManoeuvreState.DONE, 5.0, 60.0),
    ],
)
def test_a_manoeuvre_of_a_base_that_hardly_moves_ends(
    manoeuvre: Callable[[], Manoeuvre], share: float, end: ManoeuvreState, least: float, most: float
) -> None:
    _, state, time = end_of(manoeuvre(), None, share)
    assert state is end
    assert least < time < most
