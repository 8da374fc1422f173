"""A camera is measured by a tag on the hand, as well as the noise of both allows; too little motion is refused."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3, quaternion_about, quaternion_from_rpy
from rbxcompose.domains.arms.command_camera import HandSight, PoorMotionsError, StandingHand, measured

CAMERA = Transform3((0.1, 0.02, 1.2), quaternion_from_rpy(-2.0, 0.1, -1.5))
TAG = Transform3((0.05, 0.01, -0.03), quaternion_from_rpy(0.3, 1.2, -0.4))


def apart(one: Transform3, other: Transform3) -> tuple[float, float]:
    """Return how far two poses are apart [m] and [rad]."""
    between = one.inverse().compose(other)
    return math.dist(one.translation, other.translation), 2 * math.acos(min(1.0, abs(between.rotation[3])))


def pairs(
    turns: Sequence[tuple[float, float, float]], noise: tuple[float, float] = (0.0, 0.0), camera: Transform3 = CAMERA
) -> list[HandSight]:
    """Return pairs for hands turned by roll, pitch and yaw; `noise` is that of the tag [m] and [rad]."""
    random = np.random.default_rng(3)
    made = []
    for turn in turns:
        x, y, z = random.uniform((0.4, -0.3, 0.6), (0.8, 0.3, 1.1)).tolist()
        hand = Transform3((x, y, z), quaternion_from_rpy(*turn))
        a, b, c = random.normal(0, noise[0], 3).tolist()
        axis = random.normal(size=3)
        axis /= np.linalg.norm(axis)
        wrong = Transform3((a, b, c), quaternion_about(tuple(axis.tolist()), float(random.normal(0, noise[1]))))
        made.append(HandSight(hand, camera.inverse().compose(hand).compose(TAG).compose(wrong)))
    return made


def turned(count: int, angle: float = 0.6) -> list[tuple[float, float, float]]:
    return [tuple(turn) for turn in np.random.default_rng(5).uniform(-angle, angle, (count, 3)).tolist()]


@given(st.tuples(*[st.floats(-1, 1)] * 3), st.tuples(*[st.floats(-3.1, 3.1)] * 3))
def test_without_noise_the_camera_is_where_it_is(at: tuple[float, ...], turn: tuple[float, ...]) -> None:
    x, y, z = at
    camera = Transform3((x, y, z), quaternion_from_rpy(*turn))
    found = measured(pairs(turned(5), camera=camera))
    assert apart(found.camera, camera) == pytest.approx((0, 0), abs=1e-6)
    assert apart(found.tag, TAG) == pytest.approx((0, 0), abs=1e-6)
    assert found.misses == pytest.approx((0, 0), abs=1e-6)


def test_with_noise_it_is_as_near_as_it_says() -> None:
    found = measured(pairs(turned(15), (0.002, math.radians(0.5))))
    away, angle = apart(found.camera, CAMERA)
    assert away < 0.008
    assert angle < math.radians(0.8)
    assert away < 3 * found.known_to[0] < 0.03
    assert angle < 3 * found.known_to[1] < math.radians(3)
    assert 0.001 < found.misses[0] < 0.005
    assert math.radians(0.3) < found.misses[1] < math.radians(1.0)
    assert len(found.off) == 15


@pytest.mark.parametrize(
    ("turns", "why"),
    [
        ([(0, 0, 0), (0.5, 0.5, 0)], "2 poses of the hand are too few: 3 is the least"),
        ([(0, 0, 0.02 * n) for n in range(8)], r"the hand has turned by \d deg only"),
        ([(0, 0, 0.3 * n) for n in range(8)], "the hand has turned about one axis only"),
    ],
)
def test_motions_that_are_too_few_or_too_alike_are_told(turns: list[tuple[float, float, float]], why: str) -> None:
    with pytest.raises(PoorMotionsError, match=why):
        measured(pairs(turns))


def test_a_pair_is_taken_when_the_hand_stands_somewhere_else() -> None:
    hand, standing = StandingHand(), pairs([(0, 0, 0), (0.5, 0, 0)], (0.001, 0.01))
    moving = HandSight(Transform3((0.5, 0.1, 0.8)), standing[0].tag)
    taken = []
    for number, reading in enumerate([standing[0]] * 15 + [moving] + [standing[0]] * 15 + [standing[1]] * 15):
        if hand.take(0.1 * number, reading):
            taken.append(number)
    assert taken == [10, 41]
    assert apart(hand.pairs[1].tag, standing[1].tag) == pytest.approx((0, 0), abs=1e-6)
