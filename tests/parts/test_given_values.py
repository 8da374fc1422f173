"""What a part gives need not be taken."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.parts.project import BATTERY, Project

PART = BATTERY + "values: {level: battery.battery_level}\nprovides: {values: [level]}\n"
ROBOT = """
places: {dock: {x: 0 m, y: 0 m}}
include: {spare: ../../parts/battery.yaml}
missions: {idle: ../../missions/idle.yaml}
"""
IDLE = {"missions/idle.yaml": "rbx: 1\nkind: Mission\nname: idle\ndo: {wait: 1 s}\n"}


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path)


def test_a_value_that_a_part_brings_may_be_left_unread(project: Project) -> None:
    assert "RBX3012" not in project.check(ROBOT, {"battery": PART}, files=IDLE).codes


def test_one_of_the_robot_itself_may_not(project: Project) -> None:
    own = ROBOT + "values: {level: spare_battery.battery_level}\n"
    assert "RBX3012" in project.check(own, {"battery": PART}, files=IDLE).codes


def test_a_mux_input_from_nobody_is_told_that_it_may_be_open(project: Project) -> None:
    mux = "\nmuxes: {cmd_vel: {inputs: {stick: {from: joystick, priority: 1, timeout: 1 s}}}}\n"
    [finding] = project.check(ROBOT + mux, {"battery": PART}, files=IDLE).compilation.report.findings[:1]
    assert finding.help.endswith("without 'from' the input is open to the outside")
