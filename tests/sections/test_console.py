"""The section `console`: what the gateway learns from the rest of the manifest."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from rbxcompose.domains.console.lease import DriveLimits
from tests.parts.project import Project

BASE = """
components:
  base: {type: diff_drive_sim, max_speed: 0.5 m/s, max_turn_rate: 1 rad/s}
  battery: {type: battery_sim, runtime: 45 s}
"""
MUX = """
muxes:
  cmd_vel:
    inputs:
      joystick: {priority: 200, timeout: 0.5 s}
      teleop: {priority: 100, timeout: 0.5 s}
"""
TWIST = "geometry_msgs/msg/Twist"


def gateway(folder: Path, text: str, **options: Any) -> Any:
    """Return the configuration of the gateway in the plan."""
    checked = Project(folder).check(text, **options)
    assert checked.compilation.plan, checked.text
    return next(made for made in checked.compilation.plan.instances if made.name == "gateway").config


def test_a_robot_without_the_section_has_no_gateway(tmp_path: Path) -> None:
    plan = Project(tmp_path).check(BASE).compilation.plan
    assert plan
    assert "gateway" not in [instance.type for instance in plan.instances]


def test_an_empty_section_is_enough(tmp_path: Path) -> None:
    config = gateway(tmp_path, f"about: Rolls.\n{BASE}console: {{}}")
    assert (config.robot, config.about, config.port, config.first_page) == ("one", "Rolls.", 8080, "drive")
    assert config.drive == DriveLimits("/cmd_vel", TWIST, 0.5, 1.0)


def test_people_drive_by_the_input_teleop_of_the_mux_before_the_base(tmp_path: Path) -> None:
    assert gateway(tmp_path, f"{BASE}{MUX}console: {{}}").drive.topic == "/cmd_vel/teleop"


def test_what_is_written_counts_within_the_limits_of_the_base(tmp_path: Path) -> None:
    drive = "{topic: cmd_vel/joystick, max_speed: 2 m/s, max_turn_rate: 0.5 rad/s}"
    config = gateway(tmp_path, f"{BASE}{MUX}console: {{port: 80, pages: [map, drive], drive: {drive}}}")
    others = frozenset({"/cmd_vel", "/cmd_vel/teleop"})
    assert config.drive == DriveLimits("/cmd_vel/joystick", TWIST, 0.5, 0.5, others)
    assert (config.port, config.pages) == (80, ("map", "drive"))


def test_names_are_those_on_the_bus(tmp_path: Path) -> None:
    values = "values:\n  charge: battery.battery_level\n  door: {topic: door/state, type: text}\n"
    config = gateway(tmp_path, f"{BASE}{MUX}{values}bus: {{namespace: robot_1}}\nconsole: {{}}")
    assert config.drive.topic == "/robot_1/cmd_vel/teleop"
    text = {"topic": "/robot_1/door/state", "type": "std_msgs/msg/String", "field": "data", "unit": ""}
    level = {"topic": "/robot_1/battery_level", "type": "std_msgs/msg/Float32", "field": "data", "unit": "%"}
    assert config.values == {"charge": level, "door": text}


def test_the_page_gets_the_places_with_their_colours(tmp_path: Path) -> None:
    places = "places:\n  dock: {x: 50 cm, y: -1 m, heading: 180 deg, colour: red}\n  door: {x: 1 m, y: 2 m}\n"
    config = gateway(tmp_path, f"{BASE}{places}console: {{}}")
    assert config.places == {
        "dock": {"x": 0.5, "y": -1.0, "heading": math.pi, "colour": "red"},
        "door": {"x": 1.0, "y": 2.0, "heading": 0.0, "colour": ""},
    }


def test_a_robot_that_does_not_drive_has_a_console_too(tmp_path: Path) -> None:
    config = gateway(tmp_path, "components:\n  battery: {type: battery_sim, runtime: 45 s}\nconsole: {}")
    assert (config.drive, config.max_speed) == (None, math.inf)


def test_the_network_is_served_with_roles_by_names(tmp_path: Path) -> None:
    guard = "{/arm/*: configure}"
    config = gateway(tmp_path, f"{BASE}console: {{listen: lan, guard: {guard}, origins: ['http://localhost:8181']}}\n")
    assert (config.listen, config.guard, config.origins) == ("lan", {"/arm/*": "configure"}, ("http://localhost:8181",))


def test_drivers_see_colours_rather_than_depths(tmp_path: Path) -> None:
    camera = "  eye: {type: camera_sim, frame: base_footprint, depth: true}\n"
    assert gateway(tmp_path, f"{BASE}{camera}console: {{}}").camera == "/camera/image_raw"
    drive = "{drive: {camera: eye}}"
    assert gateway(tmp_path, f"{BASE}{camera}console: {drive}").camera == "/camera/image_raw"
