"""Tags in pictures: which they are, and where."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3, conjugate, multiply
from tests.vision.tagged import CAMERA, facing, picture

pytest.importorskip("cv2", reason="OpenCV is not installed")
from rbxcompose.domains.vision.tags import TagFinder, board_pose
from rbxcompose.domains.worlds.tag_pictures import FAMILIES, dictionary, tag_picture
from tests.loops import for_all

SIZE = 0.15
FINDER = TagFinder(size=SIZE)


def angle_between(one: Transform3, other: Transform3) -> float:
    return 2 * math.acos(min(1.0, abs(multiply(one.rotation, conjugate(other.rotation))[3])))


@given(
    st.integers(0, 586), st.floats(0.6, 2.5), st.floats(0, 60), st.floats(0, 360), st.floats(0, 360), st.floats(-1, 1)
)
def test_a_tag_is_found_where_it_is(
    number: int, distance: float, tilt: float, about: float, roll: float, aside: float
) -> None:
    pose = facing(
        aside * 0.2 * distance,
        aside * 0.2 * distance,
        distance,
        tilt=math.radians(tilt),
        about=math.radians(about),
        roll=math.radians(roll),
    )
    (found,) = FINDER.find(picture({number: pose}, SIZE), CAMERA)
    assert found.number == number
    assert found.pose is not None
    assert math.dist(found.pose.translation, pose.translation) < 0.04 * distance
    if found.doubt < 0.2:
        assert angle_between(found.pose, pose) < math.radians(8)


@for_all("family", FAMILIES)
def test_families_are_as_opencv_has_them(family: str) -> None:
    known = dictionary(family)
    assert (len(known.bytesList), known.markerSize + 2) == FAMILIES[family][1:]


def test_errors_of_the_pose_are_as_large_as_its_covariance_says() -> None:
    pose = facing(0.2, 0.1, 1.5, tilt=0.7, about=1.0)
    errors = []
    for seed in range(15):
        (found,) = FINDER.find(picture({5: pose}, SIZE, seed=seed), CAMERA)
        assert found.pose is not None
        assert found.covariance is not None
        off = np.subtract(found.pose.translation, pose.translation)
        errors.append(off @ np.linalg.solve(found.covariance[:3, :3], off))
    assert 0.3 < np.mean(errors) < 6  # of a sum of three squares, which is 3 on average


@for_all("family", FAMILIES)
def test_each_family_is_printed_and_found(family: str) -> None:
    (found,) = TagFinder(family, 0.3).find(picture({3: facing(0, 0, 1)}, 0.3, family=family), CAMERA)
    assert found.number == 3
    assert found.pose is not None
    assert found.pose.translation[2] == pytest.approx(1, abs=0.01)


def test_ten_tags_are_found_at_once_in_the_order_of_their_numbers() -> None:
    tags = {n: facing(-0.8 + 0.4 * (n % 5), -0.25 + 0.5 * (n // 5), 2) for n in range(10)}
    found = FINDER.find(picture(tags, SIZE), CAMERA)
    assert [tag.number for tag in found] == list(range(10))


def test_two_tags_with_one_number_are_both_there() -> None:
    seen = picture({7: facing(-0.3, 0, 1.5)}, SIZE, noise=0)
    seen[:, 320:] = picture({7: facing(0.3, 0, 1.5)}, SIZE, noise=0)[:, 320:]
    left, right = FINDER.find(seen, CAMERA)
    assert left.pose is not None
    assert right.pose is not None
    assert (left.number, right.number) == (7, 7)
    assert left.pose.translation[0] < 0 < right.pose.translation[0]


def test_from_the_edge_a_tag_is_never_another_one_and_mirrored_it_is_none() -> None:
    for tilt in range(70, 90, 4):
        seen = FINDER.find(picture({7: facing(0, 0, 1, tilt=math.radians(tilt))}, SIZE), CAMERA)
        assert [tag.number for tag in seen] in ([], [7])
    assert FINDER.find(picture({7: facing(0, 0, 1)}, SIZE)[:, ::-1].copy(), CAMERA) == []


def test_half_a_tag_is_none() -> None:
    seen = picture({7: facing(0, 0, 1)}, SIZE)
    seen[:, :320] = 128
    assert FINDER.find(seen, CAMERA) == []


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=settings().max_examples // 2)
def test_noise_has_no_tags(seed: int) -> None:
    noise = np.random.default_rng(seed)
    coarse = np.kron(noise.integers(0, 2, (60, 80)) * 255, np.ones((8, 8))).astype(np.uint8)
    assert FINDER.find(coarse, CAMERA) == []


def test_without_a_size_a_tag_has_no_pose() -> None:
    (found,) = TagFinder().find(picture({7: facing(0, 0, 1)}, SIZE), CAMERA)
    assert found.pose is None
    (found,) = TagFinder(sizes={7: SIZE}).find(picture({7: facing(0, 0, 1)}, SIZE), CAMERA)
    assert found.pose is not None
    assert TagFinder(sizes={7: 0.0}).find(picture({7: facing(0, 0, 1)}, SIZE), CAMERA) == []


def test_a_board_is_where_its_tags_are_and_steadier_than_one() -> None:
    places = {1: Transform3((-0.2, 0, 0)), 2: Transform3((0.2, 0, 0))}
    board = facing(0.1, 0, 2, tilt=0.5, about=1.5)
    seen = picture({n: board.compose(place) for n, place in places.items()}, SIZE)
    tags = FINDER.find(seen, CAMERA)
    found = board_pose(tags, places, dict.fromkeys(places, SIZE), CAMERA)
    assert found is not None
    assert math.dist(found[0].translation, board.translation) < 0.01
    assert angle_between(found[0], board) < math.radians(1.5)
    assert all(np.trace(found[1]) < np.trace(tag.covariance) for tag in tags if tag.covariance is not None)
    assert board_pose(tags, {9: Transform3()}, {9: SIZE}, CAMERA) is None


def test_a_tag_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ValueError, match="has the tags 0 to 586, and no 587"):
        tag_picture(587)
