"""Robots of a system in one world: they see each other, and stop where they touch."""

from __future__ import annotations

import json
import math
import os
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from rbxcompose.base.geometry import Pose2
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import to_data
from rbxcompose.commands.hosts import Remote
from rbxcompose.commands.main import main
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.systems.model import System
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.domains.bases.components.diff_drive_sim import DiffDriveSim
from rbxcompose.domains.worlds.commands.world import world_named
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.rbxcompose_msgs import Switches, WorldRobots
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.runtime.folder import NO_LAYERS, ChosenLayers, RobotFolder
from rbxcompose.runtime.plan_requests import PlanComparison
from rbxcompose.runtime.supervision.plan_change import changes
from rbxcompose.testing import Bench
from rbxcompose.testing.bench import SystemBench
from rbxcompose.tools import system_runs
from rbxcompose.tools.inspection.plan_text import with_places
from rbxcompose.tools.robot_changes import Proposal

ROBOT = """rbx: 1
kind: Robot
name: box
world: hall.yaml
muxes:
  cmd_vel: {inputs: {joystick: {priority: 10, timeout: 0.5 s}}}
components:
  base: {type: diff_drive_sim, max_speed: 0.5 m/s}
  laser: {type: laser_sim, frame: base_footprint, rays: 4, view: 270 deg}
  bumpers: {type: bumper_sim}
"""
WORLD = """rbx: 1
kind: World
name: hall
spawn:
  west: {x: -1 m, y: 0 m}
  east: {x: 1 m, y: 0 m, heading: 180 deg}
  north: {x: 0 m, y: 3 m, heading: -90 deg}
  near: {x: 1.3 m, y: 0 m}
"""
SYSTEM = """rbx: 1
kind: System
name: hall
world: hall.yaml
hosts: {here: {}}
robots:
  a: {robot: robot.yaml, spawn: west}
  b: {robot: robot.yaml, spawn: east}
"""
THIRD = "  c: {robot: robot.yaml, spawn: north}\n"
OVERLAP = 0.005  # [m] since what robots know of each other is up to 50 ms old


def compiled(folder: Path, system: str = SYSTEM, robot: str = ROBOT) -> System:
    for name, text in {"robot.yaml": robot, "hall.yaml": WORLD, "system.yaml": system}.items():
        folder.joinpath(name).write_text(text, encoding="utf-8")
    return compile_system(str(folder / "system.yaml"), environment={})


def base_of(robot: Bench) -> DiffDriveSim:
    found = robot.component("base")
    assert isinstance(found, DiffDriveSim)
    return found


class Hall:
    """Robots in an empty hall, which drive as they are told."""

    def __init__(self, folder: Path, system: str = SYSTEM, robot: str = ROBOT) -> None:
        self.bench = SystemBench(compiled(folder, system, robot))
        self.touched = {name: robot.collect("/contact", String) for name, robot in self.bench.robots.items()}

    def base(self, name: str) -> DiffDriveSim:
        return base_of(self.bench.robots[name])

    def seen(self, name: str, other: str) -> Pose2:
        """Return where a robot's base takes another one to be."""
        world = self.base(name).world
        assert world is not None
        index = [robot.name for robot in world.robots].index(other)
        return Pose2(*world.robots_at(self.bench.clock.now())[index].tolist())

    def apart(self, one: str, other: str) -> float:
        """Return the room between two robots [m]."""
        return self.base(one).core.pose.distance(self.base(other).core.pose) - 2 * 0.2

    def drive(self, seconds: float, **speeds: float) -> float:
        """Drive robots for a time, and return the least room between the first two meanwhile."""
        least = math.inf
        for _ in range(round(seconds / 0.1)):
            for name, speed in speeds.items():
                self.bench.robots[name].publish("/cmd_vel/joystick", Twist(linear=Vector3(x=speed)))
            for _ in range(5):
                self.bench.advance(0.02)
                least = min(least, self.apart("a", "b"))
        return least


def test_robots_that_drive_at_each_other_stop_where_they_touch_and_feel_it(tmp_path: Path) -> None:
    hall = Hall(tmp_path)
    pressed = {name: robot.collect("/bumper", Switches) for name, robot in hall.bench.robots.items()}
    assert hall.drive(3.0, a=0.5, b=0.3) > -OVERLAP
    assert abs(hall.apart("a", "b")) < OVERLAP
    assert {name: {message.data for message in heard} for name, heard in hall.touched.items()} == {
        "a": {"b"},
        "b": {"a"},
    }
    assert [pressed[name][-1].is_on for name in "ab"] == [(False, True, False)] * 2
    hall.drive(1.0, a=-0.5)
    assert hall.apart("a", "b") > 0.2
    assert [pressed[name][-1].is_on for name in "ab"] == [(False, False, False)] * 2


def test_each_sees_all_others_wherever_they_go(tmp_path: Path) -> None:
    hall = Hall(tmp_path, SYSTEM + THIRD)
    scans = hall.bench.robots["b"].collect("/scan", LaserScan)
    hall.bench.advance(0.3)
    c_ahead = hall.base("c").core.pose.distance(hall.base("b").core.pose) - 0.2
    assert np.isinf(scans[-1].ranges).tolist() == [True, True, True, True], "its rays go past both"
    hall.base("b").core.pose = Pose2(1.0, 0.0, math.pi + math.radians(45))
    hall.drive(1.0, a=0.2)
    assert scans[-1].ranges[1] == pytest.approx(hall.apart("a", "b") + 0.2, abs=0.01)
    towards = math.atan2(3.0, -1.0)
    hall.base("b").core.pose = Pose2(1.0, 0.0, towards + math.radians(45))
    hall.bench.advance(0.2)
    assert scans[-1].ranges[1] == pytest.approx(c_ahead, abs=1e-3)


def test_a_robot_that_says_nothing_stands_where_it_was_and_is_reported(tmp_path: Path) -> None:
    hall = Hall(tmp_path, SYSTEM + THIRD)
    statuses = {name: robot.statuses("world: other robots") for name, robot in hall.bench.robots.items()}
    hall.drive(1.5, c=0.5)
    assert [heard[-1].level for heard in statuses.values()] == [Level.OK] * 3
    gone = hall.bench.robots.pop("c")
    hall.drive(4.0, a=0.5)
    assert statuses["b"][-1].level == Level.WARN
    assert statuses["b"][-1].message == "c silent: stands where it was"
    a, c = hall.base("a").core.pose, base_of(gone).core.pose
    assert hall.touched["a"][0] == String(data="b")
    assert hall.seen("b", "c").distance(c) < 0.05
    assert a.x < 1.0


def test_a_robot_that_the_first_one_does_not_know_reports_that(tmp_path: Path) -> None:
    bench = Bench(plan=compiled(tmp_path, SYSTEM + THIRD).robots["c"].plan)
    statuses = bench.statuses("world: other robots")
    for names in (("a", "b", "c"), ("a", "b")):
        xs = np.zeros(len(names))
        message = WorldRobots(Header(frame_id="map"), names, xs, xs, xs, xs, xs, (False,) * len(names))
        bench.publish("/a/world/robots", message)
        bench.advance(1.2)
    assert [status.level for status in statuses] == [Level.OK, Level.ERROR]
    assert statuses[-1].message == "the world of a has a, b: all need 'down' and 'up'"


@pytest.mark.soak  # as those of one robot are
def test_two_runs_are_alike(tmp_path: Path) -> None:
    def driven() -> tuple[list[Pose2], list[str]]:
        hall = Hall(tmp_path, SYSTEM + THIRD)
        hall.drive(2.0, a=0.5, b=0.5, c=0.3)
        logs = [record.to_json() for robot in hall.bench.robots.values() for record in robot.records]
        return [hall.base(name).core.pose for name in "abc"], logs

    assert driven() == driven()


@pytest.mark.parametrize(
    ("old", "new", "codes"),
    [
        ("spawn: east", "spawn: west", ["RBX6154"]),
        (
            "b: {robot: robot.yaml, spawn: east}",
            "b: {robot: robot.yaml, spawn: [east, near], instances: 2}",
            ["RBX6154"],
        ),
        ("spawn: east", "spawn: est", ["RBX6102", "RBX1004"]),
        ("world: hall.yaml\n", "", ["RBX1002", "RBX1002"]),
        ("world: hall.yaml", "world: hal.yaml", ["RBX1301"]),
    ],
    ids=["same spawn", "outlines overlap", "unknown spawn", "no world", "no such world"],
)
def test_starts_that_cannot_be_are_findings(tmp_path: Path, old: str, new: str, codes: list[str]) -> None:
    system = compiled(tmp_path, SYSTEM.replace(old, new))
    assert [finding.code for finding in system.report] == codes, [f.message for f in system.report]
    assert all(finding.span and finding.span.file.endswith("system.yaml") for finding in system.report)


@pytest.mark.soak  # as robots do that drive at each other without physics
def test_in_physics_robots_stop_at_each_other_too(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    hall = Hall(tmp_path, robot=ROBOT + "simulator: physics\n")
    assert hall.drive(3.0, a=0.5, b=0.3) > -0.02
    assert abs(hall.apart("a", "b")) < 0.02
    assert hall.touched["a"][0] == String(data="b")


def test_a_robot_is_not_brought_into_a_world_that_runs_without_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    before = compiled(tmp_path).robots

    def compared(plan: Plan, robot: Robot, layers: ChosenLayers) -> Namespace:
        found = changes(before[plan.robot].plan, plan)
        return Namespace(data=with_places(to_data(PlanComparison.of(found, 1, "; ".join(found.impossible))), robot))

    def asked(self: Remote, words: Sequence[str], *, folder: str = "", has_terminal: bool = False) -> list[str]:
        if (name := words[words.index("--robot") + 1]) in before:
            return ["sh", "-c", 'echo "$0"; exit 1', json.dumps(compared(*ours[name], NO_LAYERS).data)]
        return ["sh", "-c", f"echo \"error[RBX9002]: no robot '{name}' is up\"; exit 1"]

    monkeypatch.setattr(Proposal, "of", compared)
    monkeypatch.setattr(Remote, "rbxcompose", asked)
    monkeypatch.setattr(system_runs, "run_plan", lambda *_, **__: 0)
    folders = [RobotFolder.of(name) for name in before]
    for folder in folders:
        folder.make()
    locks = [folder.lock() for folder in folders]
    file = str(tmp_path / "system.yaml")
    ours = {name: (robot.plan, robot.robot) for name, robot in compiled(tmp_path, SYSTEM + THIRD).robots.items()}
    try:
        for verb in (["up", "-d", file, "--robot", "c"], ["apply", file, "--dry-run"]):
            assert main(verb) == 1
            lines = [line for line in capfd.readouterr().err.splitlines() if line.startswith("error")]
            expected = "error[RBX6155]: 'c' is new in the world of 'a', which is up and does not know that"
            assert lines == [expected], "and nothing that only follows from it"
    finally:
        for lock in locks:
            assert lock is not None
            os.close(lock)


def test_the_listing_of_a_systems_world_has_its_robots(tmp_path: Path) -> None:
    compiled(tmp_path)
    shown = world_named(Namespace(path=str(tmp_path / "system.yaml"), profile=[]))
    assert [thing.placed(name).pose for name, thing in shown.objects.items()] == [Pose2(-1.0), Pose2(1.0, 0.0, math.pi)]


def test_the_shipped_system_is_fine() -> None:
    assert list(compile_system("rbx:systems/two_house_robots.yaml", environment={}).report) == []
