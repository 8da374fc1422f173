"""`needs`: the extras of robots, and `make up`, which installs them."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from rbxcompose.tools.commands import needs
from tests.conftest import ROOT

MONITORED = "rbx: 1\nkind: Robot\nname: one\ncomponents:\n  cpu: {type: cpu_monitor}\n  disk: {type: disk_monitor}\n"
SYSTEM = "rbx: 1\nkind: System\nname: two\nhosts: {here: {}}\nrobots: {one: {robot: ../robots/one/robot.yaml}}\n"


@pytest.mark.parametrize(
    ("path", "extras"),
    [
        pytest.param("robots/pi_robot", {"arm": ["right_arm"]}, marks=pytest.mark.soak),  # as told below
        ("parts/servo_arm.yaml", {"arm": ["right_arm"]}),
        ("missions/reach_out.yaml", {"arm": ["right_arm"]}),
        ("robots/turtlebot", {}),
    ],
)
def test_a_robot_needs_what_its_components_import(
    path: str, extras: dict[str, list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main(["needs", str(ROOT / path), "--json"]) == 0
    assert {entry["extra"]: entry["by"] for entry in json.loads(capsys.readouterr().out)} == extras


def test_a_system_needs_what_its_robots_need(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, text in {"robots/one/robot.yaml": MONITORED, "systems/two.yaml": SYSTEM}.items():
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text(text)
    assert command.main(["needs", str(tmp_path / "systems/two.yaml"), "--pip"]) == 0
    assert capsys.readouterr().out == "rbxcompose[monitors]\n"


def test_what_pip_is_given_is_a_requirement_in_any_case(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["needs", str(ROOT / "robots/turtlebot"), "--pip"]) == 0
    assert capsys.readouterr().out == "rbxcompose\n"


def test_what_is_missing_is_told_and_what_is_there_is_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = str(ROOT / "robots/pi_robot")
    assert command.main(["needs", robot, "--pip", "--missing"]) == 0
    assert capsys.readouterr().out == "\n"
    monkeypatch.setattr(needs, "find_spec", lambda name: None if name == "ompl" else name)
    assert command.main(["needs", robot, "--missing"]) == 0
    assert "lacks ompl" in capsys.readouterr().out


@pytest.mark.parametrize("extras", ["", "rbxcompose[arm]"])
def test_make_up_installs_just_what_the_robot_lacks(tmp_path: Path, extras: str) -> None:
    (tmp_path / "bin").mkdir()
    for name, body in {
        "python": f'echo "$@" >> {tmp_path}/pip',
        "rbxcompose": f'if [ "$1" = needs ]; then echo "{extras}"; else echo "$@" > {tmp_path}/up; fi',
    }.items():
        (tmp_path / "bin" / name).write_text(f"#!/bin/sh\n{body}\n")
        (tmp_path / "bin" / name).chmod(0o755)
    (tmp_path / ".up").touch()
    make = shutil.which("make") or "make"
    subprocess.run([make, "-s", "up", f"VENV={tmp_path}", "ROBOT=robots/x"], cwd=ROOT, check=True, timeout=20)
    assert (tmp_path / "up").read_text() == "up robots/x --set console.port=8080\n"
    ran = (tmp_path / "pip").read_text().splitlines()
    assert ran[-1] == "console/build.py"
    assert [words.split()[-1] for words in ran if "versions.txt" in words] == [extras] * bool(extras)
    if extras:
        versions = (tmp_path / "versions.txt").read_text().splitlines()
        assert all(version.count("==") == 1 for version in versions)
        assert any(version.startswith("ompl==") for version in versions)
