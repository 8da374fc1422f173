"""A robot with bumpers and cliff sensors: it bumps, backs off and goes on, and does not fall."""

from __future__ import annotations

import math
from collections import deque
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rbxcompose.base.geometry import AT_REST, Pose2, Velocity2, wrap_angle
from rbxcompose.base.levels import Level
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.domains.bases.checks import lead_of, speed_within
from rbxcompose.domains.bases.components.diff_drive_sim import DiffDriveCore, DiffDriveSim, DiffDriveSimConfig
from rbxcompose.domains.bases.components.safety_controller import SafetyControllerConfig, SafetyCore, SafetyPhase
from rbxcompose.domains.worlds.shapes import WorldHole
from rbxcompose.domains.worlds.world import SimulatedWorld
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.rbxcompose_msgs import Switches
from rbxcompose.msgs.std_msgs import String
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.parts.project import Project
from tests.shipped import robot_and_plan
from tests.soak import Soak

WALL = """rbx: 1
kind: World
name: wall
objects:
  wall: {box: [20 cm, 4 m, 50 cm], at: {x: 1 m}}
"""
NEAR = Pose2(0.6, 0.0)  # it feels the wall soon
FAR = WALL.replace("x: 1 m", "x: 9 m")
ISLAND = """rbx: 1
kind: World
name: island
holes:
  east: {area: [[0.8 m, -2 m], [2 m, -2 m], [2 m, 2 m], [0.8 m, 2 m]]}
  west: {area: [[-0.8 m, -2 m], [-2 m, -2 m], [-2 m, 2 m], [-0.8 m, 2 m]]}
  north: {area: [[-0.8 m, 0.8 m], [0.8 m, 0.8 m], [0.8 m, 2 m], [-0.8 m, 2 m]]}
  south: {area: [[-0.8 m, -0.8 m], [0.8 m, -0.8 m], [0.8 m, -2 m], [-0.8 m, -2 m]]}
"""


@cache
def plan_in(world: str, folder: Path) -> Plan:
    folder.joinpath("world.yaml").write_text(world, encoding="utf-8")
    robot = """
        world: ../../world.yaml
        body: {urdf: rbx:robots/kobuki/kobuki.urdf}
        components:
          base: {type: diff_drive_sim, wheel_distance: 23 cm}
        include: {safety: "rbx:parts/safety.yaml"}
        muxes:
          cmd_vel:
            inputs:
              joystick: {priority: 100, timeout: 0.5 s}
              wander: {priority: 10, timeout: 0.5 s}
    """
    checked = Project(folder).check(robot)
    assert checked.compilation.plan, checked.text
    return checked.compilation.plan


class Kobuki:
    """A robot in a world, which a program and a person drive."""

    def __init__(self, plan: Plan) -> None:
        self.bench = Bench(plan=plan)
        self.contacts = self.bench.collect("/contact", String)
        self.active = self.bench.collect("/cmd_vel/active", String, Qos.LATCHED)
        self.bench.advance(0.5)

    @property
    def base(self) -> DiffDriveSim:
        found = self.bench.component("base")
        assert isinstance(found, DiffDriveSim)
        return found

    @property
    def pose(self) -> Pose2:
        return self.base.core.pose

    def drive(self, seconds: float, **inputs: float) -> None:
        """Let inputs of the mux drive straight on at these speeds [m/s]."""
        for _ in range(round(seconds / 0.1)):
            for name, speed in inputs.items():
                self.bench.publish(f"/cmd_vel/{name}", Twist(linear=Vector3(x=speed)))
            self.bench.advance(0.1)

    def drive_until(self, source: str, most: float = 20.0, **inputs: float) -> None:
        """Drive until a source holds the base."""
        seen, end = len(self.active), self.bench.clock.now() + most
        while source not in [one.data for one in self.active[seen:]]:
            assert self.bench.clock.now() < end, [one.data for one in self.active]
            self.drive(0.1, **inputs)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("kobuki")


def test_it_bumps_backs_off_turns_away_and_goes_on(folder: Path) -> None:
    robot = Kobuki(plan_in(WALL, folder))
    robot.drive_until("safety", wander=0.3)
    assert [one.data for one in robot.contacts] == ["wall"]
    assert robot.pose.x == pytest.approx(0.9 - 0.177, abs=0.002)
    robot.drive(1.0, wander=0.3)
    assert robot.pose.x < 0.9 - 0.177 - 0.05
    robot.drive_until("wander", wander=0.3)
    assert abs(robot.pose.heading) == pytest.approx(math.radians(60), abs=0.1)
    before = robot.pose
    robot.drive(1.0, wander=0.3)
    assert robot.pose.distance(before) > 0.1


@pytest.mark.parametrize(("y", "side"), [(-0.15, -1), pytest.param(0.15, 1, marks=pytest.mark.soak)])
def test_it_turns_away_from_the_side_on_which_it_bumps(folder: Path, y: float, side: int) -> None:
    post = WALL.replace(
        "{box: [20 cm, 4 m, 50 cm], at: {x: 1 m}}", "{cylinder: {radius: 5 cm, length: 1 m}, at: {x: 1 m}}"
    )
    robot = Kobuki(plan_in(post, folder))
    robot.base.core.pose = Pose2(0.0, y)
    robot.drive_until("safety", wander=0.3)
    robot.drive_until("wander", wander=0.3)
    assert wrap_angle(robot.pose.heading) * side > 0.5


@pytest.mark.soak
def test_it_never_crosses_the_edge_of_the_floor(folder: Path, soak: Soak) -> None:
    robot, edges = Kobuki(plan_in(ISLAND, folder)), 0
    headings = np.arange(0.1, math.tau, 1.6 if soak.is_on else 3.2)
    for heading in headings:
        robot.base.core.pose = Pose2(0.0, 0.0, heading)
        for _ in range(3):
            robot.drive_until("safety", wander=0.4)
            robot.drive_until("wander", wander=0.4)
            edges += 1
            assert not robot.base.hangs
            assert max(abs(robot.pose.x), abs(robot.pose.y)) < 0.8
    assert edges == 3 * len(headings) >= 6


SENSOR = st.tuples(st.floats(0.05, 0.3), st.floats(0.05, 0.3))


@given(st.floats(-1.0, 1.0), st.floats(0.3, 3.0), st.floats(0.0, 0.02), SENSOR)
def test_a_base_that_check_does_not_warn_of_stops_before_any_edge(
    heading: float, acceleration: float, begin: float, sensor: tuple[float, float]
) -> None:
    x, y = sensor
    cliffs, wheels = [(x, y), (x, -y)], [(0.0, 0.115), (0.0, -0.115)]
    speed = min(speed_within(lead_of(cliffs, 0.23), acceleration), 1.0)
    assume(speed > 0.05)
    base = DiffDriveCore(DiffDriveSimConfig(max_speed=1.0, acceleration=acceleration), Pose2(begin, 0.0, heading))
    world = SimulatedWorld(holes=(WorldHole("edge", ((1.5, -9), (9, -9), (9, 9), (1.5, 9))),))
    safety, late = SafetyCore(SafetyControllerConfig(evades=["cliff"], holds=[])), deque([False])
    now = 0.0
    while safety.phase is SafetyPhase.WATCH or base.velocity.linear > 0:
        now += 0.02
        late.append(bool(world.over_holes(base.pose, cliffs).any()))
        safety.feel("cliff", {"cliff": 0.0} if late.popleft() else {}, now)  # one cycle later
        wanted = safety.command(now)
        base.command(wanted or Velocity2(speed), now)
        base.step(now + 0.02, 0.02)
        assert not world.over_holes(base.pose, wheels).any()


@pytest.mark.soak  # priorities are tried in `tests/mux`
def test_a_joystick_wins_over_wandering_and_loses_to_safety(folder: Path) -> None:
    robot = Kobuki(plan_in(WALL, folder))
    robot.drive(1.0, wander=0.3)
    robot.drive(2.0, wander=0.3, joystick=-0.2)
    assert robot.base.core.velocity.linear == pytest.approx(-0.2)
    assert robot.active[-1].data == "joystick"
    robot.drive_until("safety", wander=0.3, joystick=0.4)
    robot.drive(0.5, joystick=0.4)
    assert robot.active[-1].data == "safety"
    assert robot.base.core.velocity.linear < 0


def test_a_wheel_that_hangs_holds_it_until_somebody_has_put_it_back(folder: Path) -> None:
    robot = Kobuki(plan_in(ISLAND, folder))
    drops = robot.bench.collect("/wheel_drop", Switches)
    statuses = robot.bench.statuses("safety_controller")
    robot.drive_until("safety", joystick=-0.3)  # it sees no cliff behind
    assert drops[-1].is_on == (True, True)
    assert statuses[-1].message == "holds the base: left wheel_drop and right wheel_drop"
    assert statuses[-1].level == Level.ERROR
    there = robot.pose
    robot.drive(3.0, joystick=0.3)
    assert robot.pose == there
    robot.bench.bus.client("me", "/put_back", Trigger)(Trigger.Request(), lambda reply: None)
    robot.drive(0.8, joystick=0.3)
    assert robot.base.core.velocity == AT_REST
    robot.drive(2.0, joystick=0.3)
    assert robot.base.core.velocity.linear == pytest.approx(0.3)


def test_a_sensor_that_falls_silent_stops_it_and_says_so(folder: Path) -> None:
    robot = Kobuki(plan_in(FAR, folder))
    statuses = robot.bench.statuses("safety_controller")
    robot.drive(2.0, wander=0.3)
    assert robot.base.core.velocity.linear == pytest.approx(0.3)
    robot.bench.host.hosted["safety_bumpers"].component.seen = None  # type: ignore[union-attr]
    robot.drive(1.5, wander=0.3, joystick=0.3)
    assert robot.base.core.velocity == AT_REST
    assert (statuses[-1].level, statuses[-1].message) == (Level.ERROR, "holds the base: bumper is silent")


def test_without_its_controller_nothing_drives(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Kobuki(plan_in(FAR, folder))
    robot.drive(2.0, wander=0.3)

    def breaks(core: SafetyCore, now: float) -> None:
        raise RuntimeError("broken")

    monkeypatch.setattr(SafetyCore, "command", breaks)
    robot.drive(1.5, wander=0.3, joystick=0.3)
    assert robot.base.core.velocity == AT_REST
    assert any("broken" in text for text in robot.bench.texts())


def test_while_it_is_off_the_robot_may_push(folder: Path) -> None:
    robot = Kobuki(plan_in(WALL, folder))
    statuses = robot.bench.statuses("safety_controller")
    robot.base.core.pose = NEAR
    robot.drive_until("safety", wander=0.3)
    robot.bench.set_live("safety_controller", enabled=False)
    robot.drive(2.0, joystick=0.3)
    assert robot.active[-1].data == "joystick"
    assert robot.pose.x == pytest.approx(0.9 - 0.177, abs=0.002)
    assert statuses[-1].level == Level.WARN
    robot.bench.set_live("safety_controller", enabled=True)
    robot.drive(1.0, joystick=0.3)
    assert robot.active[-1].data == "safety"


def test_after_a_stop_it_begins_anew_and_still_gets_away(folder: Path) -> None:
    robot = Kobuki(plan_in(WALL, folder))
    robot.base.core.pose = NEAR
    robot.drive_until("safety", wander=0.3)
    robot.drive(0.22, wander=0.3)
    robot.bench.host.stop()
    robot.drive(2.0, wander=0.3)
    assert robot.base.core.velocity == AT_REST
    robot.bench.host.release()
    robot.drive(0.5, wander=0.0)  # it must come to rest once
    robot.drive_until("wander", wander=0.3)
    assert abs(robot.pose.heading) > 0.9


@pytest.mark.soak
def test_the_robot_that_ships_meets_everything_and_does_not_fall() -> None:
    _, plan = robot_and_plan("kobuki")
    robot = Kobuki(plan)
    robot.bench.advance(42.0)
    assert {one.data for one in robot.contacts} > {"map", "crate"}
    assert not robot.base.hangs
    assert robot.base.core.distance > 7
