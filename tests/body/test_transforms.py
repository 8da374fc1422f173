"""Promises of the tree of frames."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base import transforms
from rbxcompose.base.geometry import Pose2, Transform3, wrap_angle
from rbxcompose.base.transforms import TransformTree


def at(x: float, y: float = 0.0, heading: float = 0.0) -> Transform3:
    return Transform3.from_pose2(Pose2(x, y, heading))


def robot() -> TransformTree:
    tree = TransformTree()
    tree.set("map", "odom", at(0.0), stamp=0.0, static=True)
    tree.set("odom", "base", at(1.0, 2.0, math.pi / 2), stamp=5.0, static=False)
    tree.set("base", "camera", at(0.1), stamp=0.0, static=True)
    tree.set("base", "laser", at(0.0, 0.2), stamp=3.0, static=False)
    return tree


def pose(tree: TransformTree, target: str, source: str) -> Pose2:
    found = tree.lookup(target, source)
    assert found is not None
    return found.to_pose2()


def close(a: Pose2, b: Pose2) -> bool:
    return a.distance(b) < 1e-9 and abs(wrap_angle(a.heading - b.heading)) < 1e-9


def test_lookup_gives_the_pose_of_the_source_in_the_target() -> None:
    assert close(pose(robot(), "map", "camera"), Pose2(1.0, 2.1, math.pi / 2))


def test_lookup_goes_through_the_common_ancestor() -> None:
    assert close(pose(robot(), "laser", "camera"), Pose2(0.1, -0.2, 0.0))


def test_a_frame_is_in_itself_at_the_origin() -> None:
    assert robot().lookup("map", "map") == Transform3()


@pytest.mark.parametrize(("target", "source"), [("map", "moon"), ("moon", "map"), ("moon", "moon")])
def test_unknown_frames_are_not_connected(target: str, source: str) -> None:
    assert robot().lookup(target, source) is None
    assert robot().stamp_of(target, source) is None
    assert robot().age(target, source, now=9.0) is None


def test_two_roots_are_not_connected() -> None:
    tree = robot()
    tree.set("moon", "crater", at(1.0), stamp=0.0, static=True)
    assert tree.lookup("map", "crater") is None


def test_the_latest_value_counts() -> None:
    tree = robot()
    tree.set("odom", "base", at(4.0), stamp=6.0, static=False)
    assert close(pose(tree, "map", "base"), Pose2(4.0, 0.0, 0.0))


def test_the_oldest_dynamic_link_on_the_path_gives_the_age() -> None:
    tree = robot()
    assert tree.stamp_of("map", "laser") == 3.0
    assert tree.age("map", "laser", now=7.0) == 4.0
    assert tree.stamp_of("map", "camera") == 5.0


def test_static_links_never_grow_old() -> None:
    assert robot().stamp_of("base", "camera") == math.inf
    assert robot().age("base", "camera", now=1e9) == 0.0


def test_a_later_parent_replaces_the_earlier_one_and_says_so() -> None:
    tree = robot()
    placed = tree.set("map", "base", at(7.0), stamp=6.0, static=False)
    assert placed.accepted
    assert placed.message == "'base' has moved from 'odom' to 'map'"
    assert close(pose(tree, "map", "camera"), Pose2(7.1, 0.0, 0.0))


@pytest.mark.parametrize(
    ("parent", "child", "transform", "reason"),
    [
        ("camera", "odom", at(0.0), "is below it"),
        ("base", "base", at(0.0), "itself"),
        ("base", "", at(0.0), "needs a name"),
        ("base", "new", at(math.nan), "number that is not finite"),
        ("base", "new", Transform3(rotation=(0.0, 0.0, 0.0, 0.0)), "not a unit quaternion"),
    ],
    ids=["cycle", "itself", "nameless", "nan", "zero rotation"],
)
def test_what_would_not_be_a_tree_is_refused(parent: str, child: str, transform: Transform3, reason: str) -> None:
    tree = robot()
    before = tree.frames
    placed = tree.set(parent, child, transform, stamp=9.0, static=False)
    assert not placed.accepted
    assert reason in placed.message
    assert tree.frames == before


def test_a_rotation_that_is_nearly_a_unit_one_is_made_so() -> None:
    tree = TransformTree()
    tree.set("map", "base", Transform3(rotation=(0.0, 0.0, 0.0, 1.005)), stamp=0.0, static=True)
    assert tree.lookup("map", "base") == Transform3()


def test_the_tree_does_not_grow_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transforms, "MOST_FRAMES", 2)
    tree = TransformTree()
    assert tree.set("map", "a", at(0.0), stamp=0.0, static=True).accepted
    assert tree.set("map", "b", at(0.0), stamp=0.0, static=True).accepted
    assert not tree.set("map", "c", at(0.0), stamp=0.0, static=True).accepted
    assert tree.set("map", "b", at(1.0), stamp=0.0, static=True).accepted


FRAMES = st.sampled_from(["a", "b", "c", "d", "e", "f"])


@given(st.lists(st.tuples(FRAMES, FRAMES, st.floats(-3, 3), st.floats(-3, 3))), FRAMES, FRAMES, FRAMES)
def test_whatever_is_set_it_stays_a_tree_whose_lookups_agree(
    links: list[tuple[str, str, float, float]], a: str, b: str, c: str
) -> None:
    tree = TransformTree()
    for parent, child, x, heading in links:
        tree.set(parent, child, at(x, 1.0, heading), stamp=0.0, static=False)
    for frame in tree.frames:
        above, parents = frame, 0
        while (parent_frame := tree.parent_of(above)) is not None:
            above, parents = parent_frame, parents + 1
            assert parents <= len(tree.frames)
    ab, bc, ac, ba = tree.lookup(a, b), tree.lookup(b, c), tree.lookup(a, c), tree.lookup(b, a)
    if ab is not None and bc is not None:
        assert ac is not None
        assert close(ab.compose(bc).to_pose2(), ac.to_pose2())
    if ab is not None:
        assert ba is not None
        assert close(ab.inverse().to_pose2(), ba.to_pose2())
