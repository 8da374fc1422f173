"""The tip follows a point by the four distances: it skips what hardly moves, stops nearby, and rests far away."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import rotate
from rbxcompose.domains.arms.components.arm_tracker import ArmTrackerConfig, Chase, Pursuit

SHOULDER = (0.1, 0.0, 0.5)
SETTINGS = ArmTrackerConfig(
    name="follower",
    arm="right",
    controller="right_controller",
    base="shoulder",
    tip="hand",
    shoulder=SHOULDER,
    target="target",
    frame="camera",
    length=0.4,
)
POINTS = st.tuples(*[st.floats(-2, 2)] * 3)


def pursuit() -> Pursuit:
    return Pursuit(SETTINGS, 0.0)


@given(POINTS, POINTS)
def test_the_tip_is_sent_no_farther_than_it_should_reach_and_points_there(
    point: tuple[float, float, float], tip: tuple[float, float, float]
) -> None:
    one = pursuit()
    one.see(0.0, point)
    assert math.dist(one.goal, SHOULDER) <= 0.36 + 1e-9
    found, away = one.next(tip), math.dist(point, SHOULDER)
    if away > 1.2:
        assert (one.state, found) == (Chase.FAR, None)
    elif math.dist(tip, one.goal) <= 0.025:
        assert (one.state, found) == (Chase.THERE, None)
    else:
        assert one.state is Chase.FOLLOWING
        assert found is not None
        ahead = rotate(found[1], (min(away, 0.36), 0.0, 0.0))
        assert math.dist(found[0], [at + part for at, part in zip(SHOULDER, ahead, strict=True)]) < 1e-6


def test_what_moves_by_less_than_a_centimetre_is_where_it_was_however_often_it_does() -> None:
    one = pursuit()
    one.see(0.0, (0.4, 0.0, 0.5))
    assert one.next((0.39, 0.0, 0.5)) is None
    for step in range(100):
        one.see(0.1 * step, (0.4, 0.009 * (-1) ** step / 2, 0.5))
        assert one.next((0.39, 0.0, 0.5)) is None
    one.see(11.0, (0.4, 0.03, 0.5))
    assert one.next((0.39, 0.0, 0.5)) is not None


def test_nothing_is_followed_before_a_point_has_come_and_it_is_lost_when_none_comes_any_more() -> None:
    one = Pursuit(SETTINGS, 5.0)
    assert one.next(SHOULDER) is None
    assert one.state is Chase.WAITING
    assert [one.is_lost(now, 2.0) for now in (5.0, 7.0, 7.1)] == [False, False, True]
    one.see(7.5, (0.4, 0.0, 0.5))
    assert [one.is_lost(now, 2.0) for now in (9.5, 9.6)] == [False, True]
