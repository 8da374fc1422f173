"""Cameras in MuJoCo see colours and depths of a robot and its world."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.optics import TO_OPTICAL
from rbxcompose.domains.worlds.physics.engine import PhysicsWorld
from rbxcompose.domains.worlds.physics.looks import PhysicsCamera, colour_of
from rbxcompose.domains.worlds.physics.robot import PhysicsRobot, outline_body
from rbxcompose.domains.worlds.shapes import WorldBox, WorldLight, WorldShape
from tests.worlds.physical import empty, from_urdf, ray

EYE = (
    '<link name="base"><visual><origin xyz="1 -0.4 0.5"/><geometry><box size="0.1 0.1 0.1"/></geometry>'
    '<material name="blue"><color rgba="0 0 1 1"/></material></visual></link><link name="eye"/>'
    '<joint name="mount" type="fixed"><parent link="base"/><child link="eye"/>'
    '<origin xyz="0 0 0.5" rpy="-1.5707963267948966 0 -1.5707963267948966"/></joint>'
)
CAMERA = PhysicsCamera("eye", 160, 120, 1.2)


@pytest.fixture
def physics() -> Iterator[PhysicsWorld]:
    robot = from_urdf(EYE, drives=False)
    box = WorldShape("box", WorldBox((0.2, 0.3, 0.6)), Pose2(1.6, 0.2))
    world = replace(empty(robot, box), colours=("red",))
    made = PhysicsWorld(robot, world, cameras={"camera": CAMERA})
    try:
        made.picture("camera")
    except ImportError as error:
        pytest.skip(str(error))
    yield made
    made.close()


def test_a_camera_sees_each_colour_where_it_is(physics: PhysicsWorld) -> None:
    red, green, blue = np.moveaxis(physics.picture("camera").colours.astype(int), -1, 0)
    corners = {"red": [(x, y) for x in (1.5, 1.7) for y in (0.05, 0.35)], "blue": [(0.95, -0.45), (1.05, -0.35)]}
    for name, found in (("red", red > 2 * green), ("blue", blue > 2 * red)):
        columns = np.nonzero(found[60])[0]
        sides = [80 - y / x * CAMERA.focal_length for x, y in corners[name]]
        assert columns.min() == pytest.approx(min(sides), abs=1)
        assert columns.max() + 1 == pytest.approx(max(sides), abs=1)


def test_depths_are_those_of_rays(physics: PhysicsWorld) -> None:
    depths = physics.picture("camera").depths
    rows, columns = (places.ravel() for places in np.mgrid[5:120:10, 5:110:10])  # the rest shows the robot itself
    x, y = (columns + 0.5 - 80) / CAMERA.focal_length, (rows + 0.5 - 60) / CAMERA.focal_length
    vectors = np.stack((x, y, np.ones_like(x)), -1)
    lengths = np.linalg.norm(vectors, axis=1)
    expected = ray(physics, "eye", vectors / lengths[:, None], 60.0) / lengths
    found = depths[rows, columns]
    near = np.isfinite(expected) & (expected < 5.0)
    assert near.sum() > 30
    assert (np.abs(found[near] / expected[near] - 1) > 1e-3).sum() <= 1  # an edge may be in a pixel
    assert (found[~np.isfinite(expected)] == np.inf).all()


def test_the_outline_of_a_robot_does_not_hide_the_world_from_its_camera(physics: PhysicsWorld) -> None:
    robot = PhysicsRobot(outline_body(0.2, 0.5), drives=True)
    wall = WorldShape("wall", WorldBox((0.2, 3, 3)), Pose2(2, 0))
    camera = PhysicsCamera("base_footprint", 160, 120, 1.2, TO_OPTICAL)
    made = PhysicsWorld(robot, empty(robot, wall), cameras={"camera": camera})
    assert made.picture("camera").depths[20, 80] == pytest.approx(1.9, abs=0.01)
    made.close()


def test_a_lamp_lights_what_faces_it(physics: PhysicsWorld) -> None:
    robot = from_urdf(EYE, drives=False)
    wall = WorldShape("wall", WorldBox((0.2, 3, 3)), Pose2(2, 0))
    bright = []
    for x in (0.0, 4.0):
        lamp = WorldLight("lamp", (x, 0, 1.5), "white", 1.0)
        made = PhysicsWorld(robot, replace(empty(robot, wall), lights=(lamp,)), cameras={"camera": CAMERA})
        bright.append(int(made.picture("camera").colours[30, 80].astype(int).sum()))
        made.close()
    assert bright[0] > 1.3 * bright[1] > 0


def test_colours_are_names_or_numbers() -> None:
    assert colour_of("#ff8000") == (1.0, 128 / 255, 0.0, 1.0)
    assert colour_of("White") == (1.0, 1.0, 1.0, 1.0)
    assert colour_of("") == colour_of("no colour") != colour_of("black")


def test_a_camera_is_on_a_link_that_exists() -> None:
    robot = from_urdf(EYE, drives=False)
    with pytest.raises(ValueError, match="does not exist: 'nose'"):
        PhysicsWorld(robot, empty(robot), cameras={"camera": PhysicsCamera("nose")})
