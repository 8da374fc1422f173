"""`up` looks at the ports of real devices before anything starts; `check` and simulation need none."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.commands.main import main
from tests.checks import strangers

BODY = """<robot name="head">
  <link name="base"/>
  <link name="neck"/>
  <joint name="pan" type="revolute"><parent link="base"/><child link="neck"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="2"/></joint>
</robot>
"""
ROBOT = """rbx: 1
kind: Robot
name: head
body: {urdf: head.urdf}
buses:
  servos:
    type: dynamixel
    port: PORT
actuators:
  pan_servo: {bus: servos, model: AX-12, id: 1}
joints:
  pan: {actuator: pan_servo}
"""


@pytest.fixture(autouse=True)
def nothing_starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "head.urdf").write_text(BODY, encoding="utf-8")

    def refuse(*_: object) -> None:
        raise AssertionError("it was started")

    monkeypatch.setattr("rbxcompose.runtime.supervision.launch.start_supervisor", refuse)


def test_a_port_that_is_missing_is_told_at_its_line_before_anything_starts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("PORT", "/nowhere/ttyUSB0"), encoding="utf-8")
    assert main(["up", "--real", "robot.yaml"]) == 1
    told = capsys.readouterr().err
    assert "error[RBX2201]: /nowhere/ttyUSB0 does not exist\n  --> robot.yaml:8:11" in told


def test_neither_a_check_nor_a_simulated_robot_needs_it(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("PORT", "/nowhere/ttyUSB0"), encoding="utf-8")
    assert main(["check", "robot.yaml"]) == 0
    for words in (["up", "robot.yaml"], ["up", "--set", "buses.servos.sim=pty", "robot.yaml"]):
        with pytest.raises(AssertionError, match="it was started"):
            main(words)


def test_a_driver_whose_package_is_missing_is_told_where_it_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("rbxcompose.commands.targets.find_spec", lambda _: None)
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("PORT", "/dev/null"), encoding="utf-8")
    for words in (["--real"], ["--set", "buses.servos.sim=pty"]):
        assert main(["up", *words, "robot.yaml"]) == 1
        told = capsys.readouterr().err
        assert "error[RBX2253]: 'servos' needs the package 'dynamixel_sdk', which is not installed" in told
        assert "  --> robot.yaml:6:3" in told
        assert "pip install 'rbxcompose[servos]'" in told
    with pytest.raises(AssertionError, match="it was started"):
        main(["up", "robot.yaml"])


def test_the_drivers_of_others_are_looked_at_like_ours(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scanner = f"  scanner: {{type: {strangers.Scanner.type_name}, device: /nowhere/ttyUSB0}}\n"
    (tmp_path / "robot.yaml").write_text(f"rbx: 1\nkind: Robot\nname: cart\ncomponents:\n{scanner}", encoding="utf-8")
    assert main(["up", "robot.yaml"]) == 1
    told = capsys.readouterr().err
    assert "error[RBX2253]: 'scanner' needs the package 'toy_scanner_sdk'" in told
    assert "error[RBX2201]: /nowhere/ttyUSB0 does not exist\n  --> robot.yaml:5:38" in told
