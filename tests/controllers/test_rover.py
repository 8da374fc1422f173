"""A robot on servos, from its text: what is found in it, at which line, and that its mission succeeds."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.base.findings import Span
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.worlds.sensors import TRUTH_REMEDY
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.sdk.component import MissionOver
from rbxcompose.testing import Bench
from rbxcompose.testing.manifests import Checked, check_text
from tests.conftest import ROOT
from tests.loops import for_all

ROVER = ROOT / "robots/rover"
TEXT = (ROVER / "robot.yaml").read_text(encoding="utf-8")
NO_MISSION = TEXT.replace("missions:\n  deliver: ../../missions/deliver.yaml\nstart: deliver\n", "")
SPARE = """    acceleration: 0.5 m/s^2
  slow:
    type: diff_drive
    start: inactive
    left: left_wheel_joint
    right: right_wheel_joint
    wheel_radius: 4 cm
    wheel_distance: 20 cm
    max_speed: 0.1 m/s
"""
FOUND = {
    "two bases": (
        "RBX3013",
        "diagnostics:",
        "components:\n  other:\n    type: diff_drive_sim\n\ndiagnostics:",
        "  other:",
    ),
    "commands stay away": (
        "RBX3501",
        "    max_speed: 0.2 m/s\n",
        "    max_speed: 0.2 m/s\n    command_timeout: 20 ms\n",
        "    command_timeout: 20 ms",
    ),
    "a topic past the mux": (
        "RBX3102",
        "    max_speed: 0.2 m/s\n",
        "    max_speed: 0.2 m/s\n    commands: cmd_vel/navigation\n",
        "    commands: cmd_vel/navigation",
    ),
    "a base without frames": (
        "RBX2286",
        "    max_speed: 0.2 m/s\n",
        "    max_speed: 0.2 m/s\n    odometry: {tf: false}\n",
        "  wheels:",
    ),
    "a driver too fast": ("RBX3503", "speed: 0.18 m/s", "speed: 0.3 m/s", ""),
    "a driver far too fast": ("RBX3504", "speed: 0.18 m/s", "speed: 0.6 m/s", ""),
    "a wheel that slides": ("RBX2285", "left: left_wheel_joint", "left: lift_joint", "    left: lift_joint"),
    "a lift that turns": ("RBX2285", "joint: lift_joint", "joint: left_wheel_joint", "    joint: left_wheel_joint"),
    "a lift that is blind": (
        "RBX2280",
        "lift_servo: {bus: servos, model: XL430-W250,",
        "lift_servo: {bus: servos, model: XL-320,",
        "  lift_servo: {bus: servos, model: XL-320, id: 3, mode: velocity, neutral: 0}",
    ),
    "radius and ticks": (
        "RBX2222",
        "    wheel_radius: 4 cm\n",
        "    wheel_radius: 4 cm\n    ticks_per_metre: 16297\n",
        "    ticks_per_metre: 16297",
    ),
}


def check(folder: Path, text: str) -> Checked:
    return check_text(text, folder, others={"rover.urdf": (ROVER / "rover.urdf").read_text(encoding="utf-8")})


def line(text: str, span: Span | None) -> str:
    return text.splitlines()[span.line - 1] if span else ""


def test_it_is_fine(tmp_path: Path) -> None:
    assert check(tmp_path, NO_MISSION).codes == []


@for_all("name", FOUND)
def test_what_is_found_is_told_at_the_line_of_the_controller(name: str, tmp_path: Path) -> None:
    code, old, new, where = FOUND[name]
    text = NO_MISSION.replace(old, new, 1)
    assert text != NO_MISSION
    found = [finding for finding in check(tmp_path, text).compilation.report if finding.code == code]
    assert found
    if where:
        assert line(text, found[0].span) == where
    if name == "two bases":
        assert line(text, found[0].related[0].span) == "  wheels:"


def test_a_base_that_nobody_commands_is_told(tmp_path: Path) -> None:
    alone, _ = NO_MISSION.split("include:")
    text = alone.replace("    max_speed: 0.2 m/s\n", "    max_speed: 0.2 m/s\n    commands: wheels_vel\n")
    [finding] = check(tmp_path, text).compilation.report
    assert (finding.code, line(text, finding.span)) == ("RBX3010", "    commands: wheels_vel")


SEEING = "components:\n  laser: {type: laser_sim, frame: base_footprint}\n"
HOUSE = "world: rbx:worlds/house.yaml\n"


@for_all("world, remedies", [("", [TRUTH_REMEDY]), (HOUSE, [TRUTH_REMEDY]), (HOUSE + "simulator: physics\n", [])])
def test_a_sensor_of_the_world_on_a_base_of_servos_needs_physics(
    world: str, remedies: list[str], tmp_path: Path
) -> None:
    found = check(tmp_path, NO_MISSION + world + SEEING).compilation.report
    assert [each.help for each in found if each.code == "RBX3010"] == remedies


def test_an_alternative_to_a_base_is_fine(tmp_path: Path) -> None:
    assert check(tmp_path, NO_MISSION.replace("    acceleration: 0.5 m/s^2\n", SPARE)).codes == []


def test_a_field_of_another_section_is_found_where_it_is_written(tmp_path: Path) -> None:
    robot = check(tmp_path, NO_MISSION).compilation.robot
    assert robot
    servos = robot.components["servos"]
    assert servos.place("controllers.wheels.odometry.child") == ("controllers", "wheels", "odometry", "child")
    assert servos.place("rate") == ("buses", "servos", "rate")
    ends = {name: servos.end(name) for name in ("wheels_commands", "wheels_odometry", "wheels_tf", "servos")}
    shown = {name: robot.connection([(end, "other")]) for name, end in ends.items() if end}
    assert shown == {
        "wheels_commands": "'commands: other'",
        "wheels_odometry": "'odometry.topic: other'",
        "wheels_tf": "",
    }


def test_its_mission_succeeds_and_the_lift_is_down_again() -> None:
    plan = compile_robot(str(ROVER), environment={}).plan
    assert plan
    bench = Bench(plan=plan)
    states = bench.collect("/joint_states", JointState)
    assert bench.run_until(lambda: any(isinstance(event, MissionOver) for event in bench.events), 120.0)
    assert [event.outcome for event in bench.events if isinstance(event, MissionOver)] == ["success"]
    heights = [float(state.position[list(state.name).index("lift_joint")]) for state in states]
    assert max(heights) == pytest.approx(0.08, abs=2e-3)
    assert heights[-1] == pytest.approx(0.0, abs=2e-3)
    bench.host.stop()
    bench.advance(1.0)
    assert all(abs(value) < 0.01 for value in states[-1].velocity)
