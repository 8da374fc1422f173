"""What stands on a table is found where it is and as large as it is, by what a camera sees of it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, yaw_of
from rbxcompose.domains.vision.tabletop import (
    NothingFlatError,
    SteadyLook,
    Tabletop,
    TabletopSettings,
    TabletopThing,
    ThingNames,
    find_things,
)
from rbxcompose.domains.worlds.optics import Intrinsics
from rbxcompose.domains.worlds.shapes import WorldBox, WorldShape
from tests.vision.tables import TABLE, TOP, box, cloud, cylinder, eye

FINE = Intrinsics.of_view(480, 360, math.radians(60))
THREE = (box(0.8, -0.25, (0.05, 0.08, 0.12), 0.4), cylinder(0.85, 0.0, 0.035, 0.1), box(0.8, 0.25, (0.1, 0.06, 0.05)))


def of(found: Tabletop, shape: WorldShape) -> TabletopThing:
    """Return what is nearest to a shape."""
    at = (shape.pose.x, shape.pose.y, TOP + shape.solid.height / 2)
    return min(found.things, key=lambda thing: math.dist(thing.pose.translation, at))


def errors(thing: TabletopThing, shape: WorldShape) -> tuple[float, float]:
    """Return how far the middle and the sides are off [m]; a box may be turned by 90 degrees."""
    solid = shape.solid
    at = (shape.pose.x, shape.pose.y, TOP + solid.height / 2)
    size = solid.size if isinstance(solid, WorldBox) else (2 * solid.radius,) * 2 + (solid.height,)  # type: ignore[union-attr]
    sides = zip((*sorted(thing.size[:2]), thing.size[2]), (*sorted(size[:2]), size[2]), strict=True)
    return math.dist(thing.pose.translation, at), max(abs(value - true) for value, true in sides)


@pytest.mark.soak  # two are among the three things, too
@settings(max_examples=2)
@given(st.floats(0.75, 0.95), st.floats(-0.2, 0.2), st.floats(0.04, 0.1), st.floats(0.04, 0.1), st.floats(-3.1, 3.1))
def test_a_box_is_found_to_millimetres(x: float, y: float, wide: float, deep: float, heading: float) -> None:
    shape = box(x, y, (wide, deep, 0.12), heading)
    [found] = find_things(cloud((TABLE, shape), eye(), FINE, 0.001), eye()).things
    away, larger = errors(found, shape)
    assert (found.kind, away < 0.005, larger < 0.012) == ("box", True, True)
    turned = math.remainder(yaw_of(found.pose.rotation) - heading, math.pi / 2)
    assert abs(turned) < 0.2
    assert found.confidence > 0.5


@pytest.mark.soak  # one is among the three things, too
@settings(max_examples=2)
@given(st.floats(0.75, 0.95), st.floats(-0.2, 0.2), st.floats(0.025, 0.06), st.floats(0.05, 0.2))
def test_a_cylinder_is_found_to_millimetres(x: float, y: float, radius: float, height: float) -> None:
    shape = cylinder(x, y, radius, height)
    [found] = find_things(cloud((TABLE, shape), eye(), FINE, 0.001), eye()).things
    away, larger = errors(found, shape)
    assert (found.kind, away < 0.005, larger < 0.008) == ("cylinder", True, True)
    assert found.confidence > 0.5


@pytest.mark.parametrize(
    ("pose", "noise"),
    [
        (eye(1.3, 0.6, roll=0.3), 0.002),
        *(
            pytest.param(pose, noise, marks=pytest.mark.soak)
            for pose, noise in (
                (eye(), 0.0),
                (eye(), 0.003),
                (eye(1.3, 0.6, yaw=-0.15, roll=-0.1), 0.002),
                (eye(pitch=0.8, x=0.4), 0.002),
            )
        ),
    ],
)
def test_three_things_are_told_apart_by_a_tilted_camera_with_noise(pose: object, noise: float) -> None:
    found = find_things(cloud((TABLE, *THREE), pose, noise=noise), pose)  # type: ignore[arg-type]
    assert len(found.things) == 3
    for shape in THREE:
        thing = of(found, shape)
        away, larger = errors(thing, shape)
        assert (away < 0.008, larger < 0.015) == (True, True), (shape, thing)
    assert of(found, THREE[1]).kind == "cylinder"
    assert found.table.pose.translation[2] == pytest.approx(TOP - found.table.size[2] / 2, abs=0.003)


def test_a_table_is_a_box_as_large_as_what_is_seen_of_it() -> None:
    table = find_things(cloud((TABLE, *THREE), eye(), noise=0.002), eye()).table
    assert table.pose.translation == pytest.approx((1.0, 0.0, TOP - table.size[2] / 2), abs=0.01)
    assert table.size[:2] == pytest.approx([0.7, 1.2], abs=0.03)
    assert yaw_of(table.pose.rotation) == pytest.approx(0.1, abs=0.02)


def test_a_cloud_without_rows_of_pixels_serves_and_the_same_cloud_gives_the_same() -> None:
    points = cloud((TABLE, *THREE), eye()).reshape(-1, 3)
    found = find_things(points, eye())
    assert all(errors(of(found, shape), shape)[0] < 0.01 for shape in THREE)
    assert find_things(points, eye()) == found


def test_of_a_face_that_hides_all_else_the_thing_is_taken_to_be_as_deep_as_it_is_wide() -> None:
    pose = eye(height=0.95, pitch=0.2)
    shape = box(0.8, 0.0, (0.06, 0.06, 0.3))
    [found] = find_things(cloud((TABLE, shape), pose), pose).things
    away, larger = errors(found, shape)
    assert (away < 0.005, larger < 0.01) == (True, True)


def test_a_frame_that_is_not_quite_level_still_has_a_table() -> None:
    seen = eye(pitch=0.5 + math.radians(3))  # the robot leans by so much, and does not know it
    found = find_things(cloud((TABLE, *THREE), seen), eye(pitch=0.5))
    assert len(found.things) == 3


@pytest.mark.parametrize(
    ("points", "why"),
    [
        (np.empty((0, 3)), "the cloud has no points"),
        (np.full((240, 320, 3), math.nan), "the cloud has no points"),
        (cloud((), eye()), "there is nothing as large as a table from 0.3 m to 1.3 m high"),
        (
            np.random.default_rng(1).uniform((-0.6, -0.6, 0.4), (0.6, 0.6, 1.6), (4000, 3)),
            "there is no level plane of 200 cm^2",
        ),
        (cloud((WorldShape("wall", WorldBox((0.2, 4, 2)), Pose2(1.2, 0)),), eye()), "there is no level plane"),
    ],
)
def test_without_a_table_it_is_said_what_there_is_not(
    points: np.ndarray[tuple[int, ...], np.dtype[np.float64]], why: str
) -> None:
    with pytest.raises(NothingFlatError, match=why.replace("^", r"\^").replace("(", r"\(")):
        find_things(points, eye())


def test_a_larger_level_face_that_is_too_high_is_no_table() -> None:
    shelf = WorldShape("shelf", WorldBox((0.7, 3.0, 0.05)), Pose2(1.25, 0.0), 1.0)
    low, pose = TabletopSettings(highest=0.9), eye(height=1.5, pitch=0.7)
    far = box(0.55, 0.1, (0.06, 0.06, 0.1))
    table = WorldShape("table", WorldBox((0.6, 1.2, TOP)), Pose2(0.5, 0.0))
    found = find_things(cloud((shelf, table, far), pose), pose, low)
    assert found.table.pose.translation[2] == pytest.approx(TOP, abs=0.02)
    assert len(found.things) == 1


def test_a_table_without_an_end_has_nothing_on_it() -> None:
    endless = WorldShape("floor", WorldBox((40, 40, TOP)), Pose2())
    found = find_things(cloud((endless,), eye(), noise=0.002), eye(), TabletopSettings(farthest=2.0))
    assert found.things == ()
    assert max(found.table.size) > 1.0


@cache
def one_thing() -> TabletopThing:
    [found] = find_things(cloud((TABLE, box(0.8, 0.0, (0.06, 0.06, 0.1))), eye()), eye()).things
    return found


def at(x: float, y: float = 0.0) -> TabletopThing:
    """Return a thing elsewhere on the table."""
    thing = one_thing()
    x_of_it, y_of_it, z = thing.pose.translation
    return replace(thing, pose=replace(thing.pose, translation=(x_of_it + x - 0.8, y_of_it + y, z)))


def test_a_thing_keeps_its_name_as_long_as_it_is_near_and_not_forgotten() -> None:
    names = ThingNames(near=0.05, forget=10.0)
    one, other, moved = at(0.8), at(0.9, 0.2), at(0.83)
    assert [each.name for each in names.take(0.0, [one, other])] == ["thing_1", "thing_2"]
    assert [each.name for each in names.take(1.0, [other])] == ["thing_2"]
    assert [each.name for each in names.take(5.0, [moved])] == ["thing_1"]
    assert [each.name for each in names.take(14.0, [other, moved])] == ["thing_3", "thing_1"]


def test_a_thing_has_the_name_of_the_tag_on_it_also_when_that_is_hidden() -> None:
    names = ThingNames(near=0.05, forget=10.0)
    one, other = at(0.8), at(0.9, 0.2)
    x, y, z = one.pose.translation
    [first, second] = names.take(0.0, [one, other], [("tea", (x - 0.03, y, z)), ("gone", (x, y + 0.3, z))])
    assert (first.name, first.is_tagged, second.name, second.is_tagged) == ("tea", True, "thing_1", False)
    [again] = names.take(1.0, [one])
    assert (again.name, again.is_tagged) == ("tea", True)


def test_a_look_is_steady_when_the_last_pictures_agree() -> None:
    names, look = ThingNames(near=0.05, forget=10.0), SteadyLook(pictures=3, still=0.01)
    one, moved = at(0.8), at(0.83)
    seen = [[one], [one], [moved], [moved], [moved], [moved, one], [moved]]
    assert [look.take(names.take(0.1 * n, things)) for n, things in enumerate(seen)] == [False] * 4 + [
        True,
        False,
        False,
    ]
