"""Robots drive, touch and see in MuJoCo as they do on a floor."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.physics.conversion import WALL
from rbxcompose.domains.worlds.physics.engine import PhysicsWorld
from rbxcompose.domains.worlds.shapes import ShapePath, WorldBox, WorldCylinder, WorldShape
from rbxcompose.domains.worlds.world import SimulatedWorld
from tests.soak import rare
from tests.worlds.physical import STEP, Touch, contacts, empty, ray, shipped, shipped_world
from tests.worlds.scenes import ANGLES, grids, shapes

TURTLEBOT = shipped("turtlebot")


def run(physics: PhysicsWorld, seconds: float) -> None:
    for _ in range(round(seconds / STEP)):
        physics.step(STEP)


def speed_up(physics: PhysicsWorld, linear: float, angular: float, seconds: float = 0.5) -> None:
    """Approach a velocity as a base does whose acceleration is limited."""
    steps = round(seconds / STEP)
    for done in range(1, steps + 1):
        physics.drive(linear * done / steps, angular * done / steps)
        physics.step(STEP)


def test_it_drives_straight_as_far_as_its_wheels_say() -> None:
    physics = PhysicsWorld(TURTLEBOT, empty(TURTLEBOT))
    speed_up(physics, 0.25, 0.0)
    began = physics.base_pose.x
    run(physics, 4.0)
    pose, wheels = physics.base_pose, physics.converted.wheels
    assert wheels is not None
    ways = [angle * wheels.radius for angle in physics.wheel_angles]
    assert pose.x - began == pytest.approx(1.0, rel=0.02)
    assert physics.base_velocity.linear == pytest.approx(0.25, abs=5e-3)
    speeds = [physics.velocity(name) * sign for name, sign in physics.converted.signs.items()]
    assert [speed * wheels.radius for speed in speeds] == pytest.approx([0.25, 0.25], abs=1e-3)
    assert ways == pytest.approx([pose.x, pose.x], rel=0.02)
    assert abs(pose.y) < 1e-3
    assert abs(pose.heading) < 1e-3


@pytest.mark.parametrize("name", ["turtlebot", *rare("rover", "porter", "pi_robot", "box_robot", "house")])
def test_it_turns_a_quarter_in_place(name: str) -> None:
    robot = shipped(name)
    physics = PhysicsWorld(robot, empty(robot))
    speed_up(physics, 0.0, 0.5)
    run(physics, math.pi - 0.25 - 0.5)
    assert physics.base_velocity.angular == pytest.approx(0.5, abs=0.02)
    for done in reversed(range(25)):
        physics.drive(0.0, 0.5 * done / 25)
        physics.step(STEP)
    run(physics, 0.5)
    assert math.degrees(physics.base_pose.heading) == pytest.approx(math.degrees(0.5 * (math.pi - 0.25)), abs=4)
    assert math.hypot(physics.base_pose.x, physics.base_pose.y) < 0.02


def test_it_stays_where_it_is_if_nothing_moves_it() -> None:
    physics = PhysicsWorld(TURTLEBOT, empty(TURTLEBOT, start=Pose2(3.0, -1.0, 2.0)))
    run(physics, 2.5)
    assert physics.base_pose.distance(Pose2(3.0, -1.0)) < 1e-4
    assert physics.base_pose.heading == pytest.approx(2.0, abs=1e-4)
    felt = physics.imu("base_link")
    assert felt.acceleration == pytest.approx((0.0, 0.0, 9.81), abs=0.02)
    assert felt.angular_velocity == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


def test_a_wall_stops_it_while_its_wheels_slip() -> None:
    physics = PhysicsWorld(TURTLEBOT, shipped_world("one_wall", Pose2(-1.0, 0.0, 0.0)))
    speed_up(physics, 0.3, 0.0)
    assert all(touch.what == "the ground" for touch in contacts(physics))
    run(physics, 4.0)
    before, turned = physics.base_pose, physics.wheel_angles
    pressing: list[list[Touch]] = []
    for _ in range(round(1.0 / STEP)):
        physics.step(STEP)
        pressing.append([touch for touch in contacts(physics) if touch.what == "map"])
    assert physics.base_pose.distance(before) < 0.02
    assert min(physics.wheel_angles) > min(turned) + 1.0
    felt = [touch for touches in pressing for touch in touches]
    assert np.mean([bool(touches) for touches in pressing]) > 0.9  # it chatters a little
    assert {touch.link for touch in felt} == {"base_link"}
    assert np.median([touch.force for touch in felt]) > 1.0
    assert all(touch.normal[0] < -0.99 for touch in felt)
    assert felt[0].point[0] == pytest.approx(before.x + 0.175, abs=0.01)


def test_a_motor_that_is_too_weak_stalls_at_a_wall() -> None:
    physics = PhysicsWorld(TURTLEBOT, shipped_world("one_wall", Pose2(-1.0, 0.0, 0.0)))
    for wheel in physics.converted.signs:
        physics.limit(wheel, 0.1)
    speed_up(physics, 0.3, 0.0)
    run(physics, 4.0)
    turned = physics.wheel_angles
    run(physics, 1.0)
    assert physics.wheel_angles == pytest.approx(turned, abs=0.05)
    assert physics.effort("left_wheel_joint") == pytest.approx(0.1)


def test_somebody_who_walks_pushes_it() -> None:
    path = ShapePath(((0.0, -2.0, 0.0), (2.0, 0.0, 0.0)))
    person = WorldShape("person", WorldCylinder(0.25, 1.7), Pose2(-2.0, 0.0), path=path)
    physics = PhysicsWorld(TURTLEBOT, empty(TURTLEBOT, person))
    touched = set()
    for _ in range(150):
        physics.step(STEP)
        touched |= {touch.what for touch in contacts(physics)}
        assert physics.shape_pose("person").translation[:2] == pytest.approx(path.place_at(physics.time))
    assert "person" in touched
    assert physics.base_pose.x > 0.4


def test_it_pushes_a_box_that_is_loose_and_is_stopped_by_one_that_is_not() -> None:
    box = WorldShape("box", WorldBox((0.3, 0.3, 0.3)), Pose2(0.6, 0.0))
    ways = {}
    for mass in (0.5, None):
        physics = PhysicsWorld(TURTLEBOT, empty(TURTLEBOT, box), {} if mass is None else {"box": mass})
        speed_up(physics, 0.3, 0.0)
        run(physics, 3.0)
        ways[mass] = physics.base_pose.x
    assert ways[0.5] > 0.7
    assert ways[None] == pytest.approx(0.6 - 0.15 - 0.175, abs=0.01)


def test_the_same_commands_lead_to_the_same_states_bit_for_bit() -> None:
    states = []
    for _ in range(2):
        physics = PhysicsWorld(TURTLEBOT, shipped_world("one_wall", Pose2(-0.8, 0.1, 0.2)))
        trace = []
        for count in range(150):
            physics.drive(0.4, math.sin(count))
            physics.step(STEP)
            trace.append((physics.base_pose, physics.wheel_angles, physics.imu("base_link"), contacts(physics)))
        states.append(trace)
    assert states[0] == states[1]


def test_walls_are_where_the_map_is_occupied_and_nowhere_else() -> None:
    world = shipped_world("house", Pose2(1.0, 0.7, 0.0))
    bare = PhysicsWorld(TURTLEBOT, SimulatedWorld(world.name, world.grid, (), world.start, world.radius, world.height))
    rows, columns = np.mgrid[: world.grid.cells.shape[0] : 3, : world.grid.cells.shape[1] : 3]
    points = world.grid.to_points(np.stack((columns.ravel() + 0.5, rows.ravel() + 0.5), -1))
    into_base = bare.pose_of("base_footprint").inverse()
    above = [into_base.apply((x, y, WALL + 1.0)) for x, y in points.tolist()]
    depths = np.array([ray(bare, "base_footprint", [(0.0, 0.0, -1.0)], 10.0, origin)[0] for origin in above])
    occupied = world.grid.occupied_at(points)
    assert occupied.any()
    assert depths[occupied] == pytest.approx(1.0)
    assert depths[~occupied] == pytest.approx(WALL + 1.0)


def test_its_laser_sees_what_the_ideal_one_sees() -> None:
    angles = np.linspace(-math.pi, math.pi, 180, endpoint=False)
    directions = np.stack((np.cos(angles), np.sin(angles), np.zeros(180)), -1)
    for start in (Pose2(1.0, 0.7, 1.57), Pose2(4.8, 0.5, 0.3), Pose2(6.0, 3.5, -2.0)):
        world = shipped_world("house", start)
        seen = ray(PhysicsWorld(TURTLEBOT, world), "base_footprint", directions, 8.0, (0.0, 0.0, 0.2))
        ideal = world.distances((start.x, start.y), angles + start.heading, 8.0, 0.0, 0.2)
        assert np.isfinite(seen).any()
        both = np.isfinite(seen) & np.isfinite(ideal)
        # A ray along an edge may pass in one of them and hit in the other.
        assert (np.abs(seen[both] - ideal[both]) > 0.01).sum() + (np.isfinite(seen) != np.isfinite(ideal)).sum() <= 1


@settings(max_examples=20)
@given(grids(), shapes(), st.floats(-2, 2), st.floats(-2, 2), ANGLES, st.floats(0.0, 9.0))
def test_it_does_so_in_any_world(
    grid: GridMap, solids: tuple[WorldShape, ...], x: float, y: float, heading: float, time: float
) -> None:
    moving = tuple(
        WorldShape(solid.name, solid.solid, solid.pose, path=ShapePath(((0.0, *at), (5.0, at[1], at[0])), repeats=True))
        for solid in solids
        for at in [(solid.pose.x, solid.pose.y)]
    )
    world = SimulatedWorld("any", grid, moving, Pose2(x, y, heading), 0.2, 0.5)
    angles = np.linspace(-math.pi, math.pi, 60, endpoint=False) + 0.01  # few walls are along one of them
    directions = np.stack((np.cos(angles), np.sin(angles), np.zeros(60)), -1)
    around = [(x + dx, y + dy) for dx in (-1e-3, 1e-3) for dy in (-1e-3, 1e-3)]
    assume(all(world.distances(at, angles, 8.0, time, 0.2).min() > 0.0 for at in around))
    ideal = world.distances((x, y), angles + heading, 8.0, time, 0.2)
    physics = PhysicsWorld(TURTLEBOT, world, time=time)
    seen = ray(physics, "base_footprint", directions, 8.0, (0.0, 0.0, 0.2))
    same = np.isclose(seen, ideal, atol=1e-6)
    assert (~same).sum() <= 2  # along an edge, a ray may hit in one of them and pass in the other


def test_a_sensor_that_looks_down_sees_the_ground() -> None:
    physics = PhysicsWorld(TURTLEBOT, empty(TURTLEBOT))
    assert ray(physics, "base_footprint", [(0.0, 0.0, -1.0)], 1.0, (0.1, 0.0, 0.04)) == pytest.approx([0.04], abs=1e-3)
    assert ray(physics, "base_footprint", [(0.0, 0.0, 1.0)], 1.0).tolist() == [math.inf]
