"""A robot made of servos has no findings, whatever their models are."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.commands.new_files import write_new
from rbxcompose.domains.servos.command_actions import NewServo, ServoRobotAnswers, servo_robot_files
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.testing import check_file
from tests.loops import for_all

SUPPLY = 12.0  # [V]


@pytest.mark.parametrize("port", ["/dev/ttyUSB0", "/dev/serial/by-path/pci-0:1.0-port0", "/tmp/a b#$:", "COM3: x"])
def test_it_has_no_findings_for_any_model_and_port(port: str, tmp_path: Path) -> None:
    models = [model for model in servo_models().values() if model.volts[0] <= SUPPLY <= model.volts[1]]  # on one cable
    servos = [NewServo(id_, model) for id_, model in enumerate(models)]
    assert write_new(tmp_path, servo_robot_files(ServoRobotAnswers("arm", port, 57_600, servos))) is None
    checked = check_file(tmp_path / "robots/arm/robot.yaml")
    assert checked.text == ""
    [driver] = [instance.config for instance in checked.plan.instances if instance.type == "servo_bus"]
    assert getattr(driver, "port", None) == port


@for_all("name", servo_models())
def test_the_limits_of_a_joint_are_within_the_range_of_its_model(name: str) -> None:
    model = servo_models()[name]
    servo = NewServo(1, model)
    assert -model.family.span / 2 - model.per_tick <= servo.lower < -1
    assert 1 < servo.upper <= model.family.span / 2
