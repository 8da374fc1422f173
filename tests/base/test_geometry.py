"""Laws of poses, rotations and transforms."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import (
    Pose2,
    Quaternion,
    Transform3,
    Vector3,
    Velocity2,
    quaternion_from_rpy,
    quaternion_from_yaw,
    rotate,
    rpy_from_quaternion,
    wrap_angle,
    yaw_of,
)

LENGTHS = st.floats(-100, 100)
ANGLES = st.floats(-20, 20)
POSES = st.builds(Pose2, LENGTHS, LENGTHS, ANGLES)
POINTS = st.tuples(LENGTHS, LENGTHS, LENGTHS)


def unit(parts: tuple[float, float, float, float]) -> Quaternion:
    x, y, z, w = parts
    length = math.hypot(*parts)
    return (x / length, y / length, z / length, w / length)


PARTS = st.floats(-1, 1)
ROTATIONS = st.tuples(PARTS, PARTS, PARTS, PARTS).filter(lambda parts: math.hypot(*parts) > 0.1).map(unit)
TRANSFORMS = st.builds(Transform3, POINTS, ROTATIONS)


def same_pose(a: Pose2, b: Pose2) -> bool:
    return a.distance(b) < 1e-9 and abs(wrap_angle(a.heading - b.heading)) < 1e-9


def same_transform(a: Transform3, b: Transform3, point: Vector3) -> bool:
    # Compared by what they do: a quaternion and its negative are one rotation.
    return math.dist(a.apply(point), b.apply(point)) < 1e-9


@given(st.floats(-1e6, 1e6))
def test_a_wrapped_angle_lies_within_half_a_turn_and_points_the_same_way(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0)


@pytest.mark.parametrize("angle", [math.pi, -math.pi], ids=["left", "right"])
def test_half_a_turn_is_written_in_one_way_only(angle: float) -> None:
    assert wrap_angle(angle) == math.pi


@given(POSES, POSES, POSES)
def test_poses_are_a_group(a: Pose2, b: Pose2, c: Pose2) -> None:
    assert same_pose(a.compose(b).compose(c), a.compose(b.compose(c)))
    assert same_pose(a.compose(Pose2()), a)
    assert same_pose(Pose2().compose(a), a)
    assert same_pose(a.compose(a.inverse()), Pose2())
    assert same_pose(a.inverse().compose(a), Pose2())


@given(POSES, POSES, POSES)
def test_distance_does_not_depend_on_the_frame(frame: Pose2, a: Pose2, b: Pose2) -> None:
    assert frame.compose(a).distance(frame.compose(b)) == pytest.approx(a.distance(b), abs=1e-9)


@given(POSES, st.floats(0.01, 100), st.floats(-3.1, 3.1))
def test_bearing_is_where_the_other_pose_stands(pose: Pose2, distance: float, angle: float) -> None:
    other = pose.compose(Pose2(distance * math.cos(angle), distance * math.sin(angle), 0.0))
    assert pose.bearing(other) == pytest.approx(angle, abs=1e-6)


@given(POSES, st.floats(-1, 1), st.floats(-2, 2), st.floats(0, 5), st.floats(0, 5))
def test_an_arc_does_not_depend_on_how_it_is_divided(
    pose: Pose2, linear: float, angular: float, first: float, second: float
) -> None:
    velocity = Velocity2(linear, angular)
    assert same_pose(pose.moved(velocity, first).moved(velocity, second), pose.moved(velocity, first + second))


@given(st.floats(0.1, 10), st.floats(0.1, 2), st.floats(0, 5))
def test_an_arc_lies_on_its_circle(radius: float, angular: float, duration: float) -> None:
    arrived = Pose2().moved(Velocity2(radius * angular, angular), duration)
    turned = angular * duration
    assert same_pose(arrived, Pose2(radius * math.sin(turned), radius * (1 - math.cos(turned)), turned))


@given(st.floats(-3.14, 3.14))
def test_yaw_survives_its_quaternion(yaw: float) -> None:
    assert yaw_of(quaternion_from_yaw(yaw)) == pytest.approx(yaw, abs=1e-9)


@given(TRANSFORMS, TRANSFORMS, TRANSFORMS, POINTS)
def test_transforms_are_a_group(a: Transform3, b: Transform3, c: Transform3, point: Vector3) -> None:
    assert same_transform(a.compose(b).compose(c), a.compose(b.compose(c)), point)
    assert same_transform(a.compose(Transform3()), a, point)
    assert same_transform(Transform3().compose(a), a, point)
    assert same_transform(a.compose(a.inverse()), Transform3(), point)
    assert same_transform(a.inverse().compose(a), Transform3(), point)


@given(TRANSFORMS, POINTS, POINTS)
def test_transforms_keep_distances(transform: Transform3, a: Vector3, b: Vector3) -> None:
    assert math.dist(transform.apply(a), transform.apply(b)) == pytest.approx(math.dist(a, b), abs=1e-9)


@given(POSES, POSES)
def test_a_pose_on_the_ground_is_a_transform_that_composes_alike(a: Pose2, b: Pose2) -> None:
    assert same_pose(Transform3.from_pose2(a).compose(Transform3.from_pose2(b)).to_pose2(), a.compose(b))


@pytest.mark.parametrize(
    ("velocity", "finite"),
    [(Velocity2(1.0, -1.0), True), (Velocity2(math.nan, 0.0), False), (Velocity2(0.0, math.inf), False)],
    ids=["numbers", "nan", "inf"],
)
def test_a_velocity_knows_whether_it_can_be_driven(velocity: Velocity2, finite: bool) -> None:
    assert velocity.is_finite is finite


@given(ROTATIONS, POINTS)
def test_roll_pitch_and_yaw_of_a_rotation_give_it_back(rotation: Quaternion, point: Vector3) -> None:
    again = quaternion_from_rpy(*rpy_from_quaternion(rotation))
    assert math.dist(rotate(again, point), rotate(rotation, point)) < 1e-3


@given(st.sampled_from([math.pi / 2, -math.pi / 2]), ANGLES, ANGLES, POINTS)
def test_straight_up_or_down_roll_counts_as_yaw(pitch: float, roll: float, yaw: float, point: Vector3) -> None:
    rotation = quaternion_from_rpy(roll, pitch, yaw)
    found = rpy_from_quaternion(rotation)
    assert found[0] == 0.0
    assert math.dist(rotate(quaternion_from_rpy(*found), point), rotate(rotation, point)) < 1e-3
