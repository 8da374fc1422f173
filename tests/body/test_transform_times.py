"""Promises of look-ups at a time: what is between two poses, what is not known, and what is forgotten."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base import transforms
from rbxcompose.base import transforms as pose_history
from rbxcompose.base.geometry import Pose2, Transform3, composed, lerp, slerp
from rbxcompose.base.transforms import (
    LATE,
    SPAN,
    ExtrapolationError,
    NotConnectedError,
    TransformAnswer,
    TransformError,
    TransformTree,
    UnknownFrameError,
)
from tests.body.moving_frames import MOST, POSES, SECOND, Move, angle_between, fill, is_same, moves

TIMES = st.integers(0, MOST)


def at(x: float, heading: float = 0.0) -> Transform3:
    return Transform3.from_pose2(Pose2(x, 0.0, heading))


def between(a: Transform3, b: Transform3, fraction: float) -> Transform3:
    return Transform3(lerp(a.translation, b.translation, fraction), slerp(a.rotation, b.rotation, fraction))


def moved(tree: TransformTree, stamp: float, pose: Transform3, child: str = "base") -> TransformAnswer:
    """Place a frame in `odom` at a stamp [s], a second after which it is received."""
    return tree.set("odom", child, pose, stamp=stamp + 1.0, static=False, measured=round(stamp * SECOND))


def driving() -> TransformTree:
    """A base that drives 1 m/s from 10 s to 14 s, in a map that has always been there, with an arm seen till 13 s."""
    tree = TransformTree()
    tree.set("map", "odom", at(0.5), stamp=0.0, static=True)
    for second in range(10, 15):
        moved(tree, second, at(float(second)))
    for second in (11, 13):
        tree.set("base", "arm", at(0.0), stamp=second, static=False, measured=second * SECOND)
    return tree


def x_at(tree: TransformTree, time: float, target: str = "odom", source: str = "base") -> float:
    return tree.lookup_at(target, source, round(time * SECOND)).translation[0]


@given(moves())
def test_at_a_stamp_the_pose_is_exactly_what_was_sent(poses: list[Move]) -> None:
    tree = TransformTree()
    fill(tree, "odom", "base", poses)
    for stamp, pose in poses:
        found = tree.lookup_at("odom", "base", stamp)
        assert found.translation == pose.translation
        assert angle_between(found.rotation, pose.rotation) < 1e-7


@given(POSES, POSES, st.floats(0, 1))
def test_between_two_poses_it_is_on_the_line_and_on_the_shortest_arc(
    a: Transform3, b: Transform3, fraction: float
) -> None:
    found, whole = between(a, b, fraction), angle_between(a.rotation, b.rotation)
    assert math.hypot(*found.rotation) == pytest.approx(1.0)
    assert angle_between(a.rotation, found.rotation) == pytest.approx(fraction * whole, abs=1e-6)
    assert angle_between(found.rotation, b.rotation) == pytest.approx((1 - fraction) * whole, abs=1e-6)
    whole = math.dist(a.translation, b.translation)
    assert math.dist(a.translation, found.translation) == pytest.approx(fraction * whole, abs=1e-9)
    assert math.dist(found.translation, b.translation) == pytest.approx((1 - fraction) * whole, abs=1e-9)


@given(POSES, POSES, st.floats(0, 1))
def test_a_quaternion_and_its_opposite_are_the_same_rotation_on_the_way(
    a: Transform3, b: Transform3, fraction: float
) -> None:
    x, y, z, w = b.rotation
    turned = Transform3(b.translation, (-x, -y, -z, -w))
    if angle_between(a.rotation, b.rotation) < math.pi - 1e-3:  # at half a turn, both ways are the shortest
        assert is_same(between(a, b, fraction), between(a, turned, fraction))


@given(moves(), moves(), TIMES)
def test_at_any_time_it_is_between_the_poses_before_and_after(base: list[Move], arm: list[Move], time: int) -> None:
    tree = TransformTree()
    fill(tree, "odom", "base", base)
    fill(tree, "base", "arm", arm)
    expected = []
    for poses in (arm, base):
        after = next(index for index in range(1, len(poses)) if poses[index][0] >= time)
        (start, a), (end, b) = poses[after - 1], poses[after]
        expected.append(between(a, b, (time - start) / (end - start)))
    assert is_same(tree.lookup_at("odom", "arm", time), expected[1].compose(expected[0]))
    assert is_same(composed(expected), expected[1].compose(expected[0]))


@given(moves(), moves(), POSES, TIMES)
def test_the_way_back_is_the_inverse_and_ways_can_be_joined(
    base: list[Move], arm: list[Move], laser: Transform3, time: int
) -> None:
    tree = TransformTree()
    fill(tree, "odom", "base", base)
    fill(tree, "base", "arm", arm)
    tree.set("base", "laser", laser, stamp=0.0, static=True)
    there, back = tree.lookup_at("odom", "arm", time), tree.lookup_at("arm", "odom", time)
    assert is_same(there.compose(back), Transform3())
    joined = tree.lookup_at("odom", "laser", time).compose(tree.lookup_at("laser", "arm", time))
    assert is_same(joined, there)


@given(moves(), moves(), TIMES, TIMES, TIMES)
def test_travels_in_time_can_be_joined_and_without_a_difference_are_look_ups(
    base: list[Move], arm: list[Move], a: int, b: int, c: int
) -> None:
    tree = TransformTree()
    fill(tree, "odom", "base", base)
    fill(tree, "base", "arm", arm)
    first, second = (tree.lookup_across("arm", number, "arm", two, "odom") for number, two in ((a, b), (b, c)))
    assert is_same(first.compose(second), tree.lookup_across("arm", a, "arm", c, "odom"))
    assert is_same(tree.lookup_across("odom", a, "arm", a, "base"), tree.lookup_at("odom", "arm", a))


@given(st.permutations(range(6)), moves())
def test_poses_within_the_time_that_counts_as_late_may_come_in_any_order(order: list[int], poses: list[Move]) -> None:
    sent = [(index * LATE // 6, poses[index % len(poses)][1]) for index in range(6)]
    tree, other = TransformTree(), TransformTree()
    fill(tree, "odom", "base", sent)
    fill(other, "odom", "base", [sent[index] for index in order])
    for time in range(0, sent[-1][0], SECOND // 17):
        assert other.lookup_at("odom", "base", time) == tree.lookup_at("odom", "base", time)


@pytest.mark.parametrize("time", [-5 * SECOND, 0, 10**18])
def test_what_is_static_holds_for_all_times(time: int) -> None:
    assert driving().lookup_at("map", "odom", time) == at(0.5)
    assert driving().newest_common("map", "odom") is None
    assert driving().lookup_common("map", "odom") == at(0.5)


def test_the_newest_look_up_takes_each_frame_as_it_was_last_seen_the_common_one_all_at_one_time() -> None:
    tree = driving()
    newest = tree.lookup("odom", "arm")
    assert newest is not None
    assert newest.translation[0] == 14.0
    assert tree.newest_common("odom", "arm") == 13 * SECOND
    assert tree.lookup_common("odom", "arm").translation[0] == 13.0


def test_what_was_seen_then_is_found_from_where_the_robot_is_now() -> None:
    found = driving().lookup_across("base", 14 * SECOND, "base", 11 * SECOND, "odom")
    assert found.translation[0] == -3.0


def test_a_pose_that_comes_late_is_put_in_its_place_and_told() -> None:
    tree = driving()
    answer = moved(tree, 13.5, at(20.0))
    assert answer == TransformAnswer(True, "the stamps of 'base' went back, by less than a second")
    assert (x_at(tree, 13.5), x_at(tree, 13.25), x_at(tree, 14.0)) == (20.0, 16.5, 14.0)


@given(st.lists(st.integers(-(10**18), 10**18), min_size=1, max_size=20))
def test_whatever_the_stamps_are_the_newest_pose_is_the_one_received_last(stamps: list[int]) -> None:
    tree = TransformTree()
    for index, stamp in enumerate(stamps):
        tree.set("odom", "base", at(float(index)), stamp=float(index), static=False, measured=stamp)
        assert tree.lookup("odom", "base") == at(float(index))
        assert tree.age("odom", "base", now=index + 0.5) == 0.5


def test_a_pose_with_a_known_stamp_replaces_that_pose() -> None:
    tree = driving()
    assert moved(tree, 13.0, at(50.0)).accepted
    assert moved(tree, 14.0, at(60.0)) == TransformAnswer(True)
    assert [x_at(tree, time) for time in (12.0, 13.0, 14.0)] == [12.0, 50.0, 60.0]
    assert tree.lookup("odom", "base") == at(60.0)


def test_a_clock_that_is_set_back_begins_a_new_history_at_once() -> None:
    tree = driving()
    answer = moved(tree, 2.0, at(7.0))
    assert answer == TransformAnswer(True, "the stamps of 'base' went back: its earlier poses are forgotten")
    assert tree.lookup("odom", "base") == at(7.0)
    with pytest.raises(ExtrapolationError):
        x_at(tree, 12.0)


def test_a_frame_that_gets_another_parent_or_stands_still_forgets_where_it_was() -> None:
    tree = driving()
    tree.set("map", "base", at(0.0), stamp=15.0, static=False, measured=15 * SECOND)
    tree.set("odom", "base", at(0.0), stamp=16.0, static=False, measured=16 * SECOND)
    with pytest.raises(ExtrapolationError, match=r"only from 16\.000 s on"):
        x_at(tree, 12.0)
    tree.set("odom", "base", at(3.0), stamp=17.0, static=True)
    assert x_at(tree, 12.0) == 3.0


def test_ten_seconds_are_known_and_no_more() -> None:
    tree = TransformTree()
    for index in range(3001):
        moved(tree, index / 100, at(float(index)))
    assert x_at(tree, 20.0) == 2000.0
    with pytest.raises(ExtrapolationError) as error:
        x_at(tree, 19.99)
    assert (error.value.oldest, error.value.newest - error.value.oldest) == (20 * SECOND, SPAN)


def test_after_a_pause_nothing_is_guessed_across_it() -> None:
    tree = driving()
    moved(tree, 100.0, at(0.0))
    with pytest.raises(ExtrapolationError):
        x_at(tree, 50.0)


def test_a_frame_that_is_sent_very_often_is_remembered_for_a_shorter_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pose_history, "MOST_POSES", 10)
    tree = TransformTree()
    for index in range(1000):
        moved(tree, index / 1000, at(float(index)))
    assert x_at(tree, 0.990) == 990.0
    with pytest.raises(ExtrapolationError):
        x_at(tree, 0.989)


@given(st.lists(st.tuples(st.sampled_from("abcde"), st.integers(0, 40), st.booleans()), max_size=200))
def test_all_frames_together_never_remember_more_than_is_allowed(sent: list[tuple[str, int, bool]]) -> None:
    tree = TransformTree()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(transforms, "MOST_POSES", 20)
        for child, stamp, is_static in sent:
            tree.set("map", child, at(1.0), stamp=0.0, static=is_static, measured=stamp * SECOND // 10)
    links = tree._links.values()
    assert tree._kept == sum(len(link.history) for link in links if link.history is not None)
    assert tree._kept <= 20 + len(links)


def test_a_look_up_of_the_future_names_the_frame_that_is_behind() -> None:
    with pytest.raises(ExtrapolationError) as error:
        driving().lookup_at("map", "arm", round(13.5 * SECOND))
    assert str(error.value) == (
        "no pose of 'arm' in 'map' at 13.500 s: 'arm' in 'base' is known only until 13.000 s, 0.5 s earlier; "
        "everything between them is known from 11.000 s to 13.000 s"
    )
    assert (error.value.limit, error.value.is_future) == ("arm", True)


def test_a_look_up_of_the_past_names_the_frame_that_begins_last() -> None:
    with pytest.raises(ExtrapolationError, match=r"10\.250 s: 'arm' in 'base' is known only from 11\.000 s on, 0.75"):
        driving().lookup_at("map", "arm", round(10.25 * SECOND))


def test_frames_that_were_never_known_at_one_time_are_told_so() -> None:
    tree = driving()
    tree.set("odom", "ball", at(0.0), stamp=30.0, static=False, measured=30 * SECOND)
    with pytest.raises(ExtrapolationError, match="everything between them is known at no time"):
        tree.lookup_common("base", "ball")


@pytest.mark.parametrize(("target", "source"), [("map", "bse"), ("bse", "map"), ("bse", "bse")])
def test_an_unknown_frame_is_told_the_frames_that_exist_the_nearest_first(target: str, source: str) -> None:
    with pytest.raises(UnknownFrameError, match=r"there is no frame 'bse'; frames: base, .*odom"):
        driving().lookup_at(target, source, 0)


def test_of_very_many_frames_only_some_are_listed() -> None:
    tree = TransformTree()
    for index in range(500):
        tree.set("map", f"crate_{index}", at(0.0), stamp=0.0, static=True)
    message = str(tree.problem("map", "crate_1234"))
    assert message.endswith(" and 495 more")
    assert len(message) < 200
    assert str(TransformTree().problem("map", "odom")) == "there is no frame 'map'; there are none yet"


def test_frames_that_are_not_connected_are_told_both_roots() -> None:
    tree = driving()
    tree.set("moon", "crater", at(0.0), stamp=0.0, static=True)
    with pytest.raises(NotConnectedError) as error:
        tree.lookup_across("odom", 0, "crater", 0, "map")
    assert isinstance(error.value, LookupError)
    assert error.value.roots == ("map", "moon")
    assert "the root of 'map' is 'map', that of 'crater' is 'moon'" in str(error.value)


def test_where_there_is_a_pose_there_is_no_problem() -> None:
    assert driving().problem("map", "arm") is None
    assert issubclass(ExtrapolationError, TransformError)
