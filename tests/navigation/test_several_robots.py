"""Robots that meet on their ways, in virtual time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rbxcompose.base.geometry import Pose2
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.domains.bases.components.diff_drive_sim import DiffDriveSim
from rbxcompose.domains.worlds.grid_map import map_files
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped, Quaternion
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.testing.bench import SystemBench
from tests.navigation.houses import room

DOOR = 0.9  # [m] wide: too narrow for two
ROOMS = room((-0.1, -2, 0.1, -DOOR / 2), (-0.1, DOOR / 2, 0.1, 2), size=4.0)
WORLD = """rbx: 1
kind: World
name: rooms
map: rooms.yaml
spawn:
  west: {x: -1.1 m, y: 0 m}
  east: {x: 1.1 m, y: 0.1 m, heading: 180 deg}
"""
ROBOT = """rbx: 1
kind: Robot
name: box
world: world.yaml
components:
  base: {type: diff_drive_sim, rate: 20 Hz}
  laser: {type: laser_sim, frame: base_footprint, rays: 120, rate: 4 Hz}
navigation: {}
"""
SYSTEM = """rbx: 1
kind: System
name: rooms
world: world.yaml
hosts: {here: {}}
robots:
  a: {robot: robot.yaml, spawn: west}
  b: {robot: robot.yaml, spawn: east}
"""


def test_robots_that_meet_in_a_doorway_both_arrive_and_touch_nothing(tmp_path: Path) -> None:
    for name, data in map_files(ROOMS, "rooms").items():
        tmp_path.joinpath(name).write_bytes(data)
    for name, text in {"robot.yaml": ROBOT, "world.yaml": WORLD, "system.yaml": SYSTEM}.items():
        tmp_path.joinpath(name).write_text(text, encoding="utf-8")
    bench = SystemBench(compile_system(str(tmp_path / "system.yaml"), environment={}))
    bench.advance(0.5)
    ends: dict[str, Ended[Any]] = {}

    def send(name: str, x: float, y: float) -> None:
        goal = NavigateToPose.Goal(pose=PoseStamped(Header(frame_id="map"), Pose(Point(x, y), Quaternion(w=1.0))))
        client = bench.robots[name].bus.action_client("me", "/go_to", NavigateToPose)
        client(goal, lambda end: ends.update({name: end}), lambda feedback: None)

    bases = {name: robot.component("base") for name, robot in bench.robots.items()}
    goals = {"a": (1.1, 0.1), "b": (-1.1, 0.0)}  # where the other one begins
    for name, goal in goals.items():
        send(name, *goal)
    assert bench.run_until(lambda: len(ends) == 2, 120.0)
    for name, base in bases.items():
        assert isinstance(base, DiffDriveSim)
        assert ends[name].outcome is Outcome.SUCCEEDED
        assert base.core.pose.distance(Pose2(*goals[name])) < 0.15
        assert base.contacts == 0
