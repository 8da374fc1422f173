"""`rbxcompose body check`: what it says of bodies, and of robots whose mistakes are elsewhere."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.commands.main import main
from rbxcompose.testing.golden import Golden
from tests.conftest import ROOT

FLAWED = """<robot name="r">
  <link name="base"/>
  <link name="arm"><visual><geometry><box size="300 1 1"/></geometry></visual></link>
  <joint name="lift" type="prismatic">
    <parent link="base"/><child link="arm"/><limit lower="0" upper="0" effort="1" velocity="1"/>
  </joint>
</robot>
"""
WRONG = FLAWED.replace('"300 1 1"', '"3 1"')
ROBOT = "rbx: 1\nkind: Robot\nname: r\nbody: {urdf: r.urdf}\n"


def checked(capsys: pytest.CaptureFixture[str], *words: str, code: int) -> str:
    assert main(["body", "check", *words]) == code
    return capsys.readouterr().out


def data(capsys: pytest.CaptureFixture[str], *words: str, code: int) -> Any:
    return json.loads(checked(capsys, *words, "--json", code=code))


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_body_without_a_flaw_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    told = checked(capsys, str(ROOT / "robots/box_robot"), code=0)
    assert told == "7 links, 2 joints that move, 4.24 kg: 0 errors, 0 warnings\n"


def test_flaws_are_told_as_check_tells_them_and_counted(
    capsys: pytest.CaptureFixture[str], golden: Golden, home: Path
) -> None:
    (home / "r.urdf").write_text(FLAWED)
    golden.check("body_check.txt", checked(capsys, "r.urdf", code=0))
    told = data(capsys, "r.urdf", code=0)
    assert (told["links"], told["joints"], told["errors"], told["warnings"]) == (2, 1, 0, 3)
    assert {finding["code"] for finding in told["findings"]} == {"RBX2009", "RBX2011", "RBX2013"}


def test_a_robot_with_the_file_has_the_same_flaws_whatever_else_is_wrong_with_it(
    capsys: pytest.CaptureFixture[str], home: Path
) -> None:
    (home / "r.urdf").write_text(FLAWED)
    (home / "robot.yaml").write_text(f"{ROBOT}components:\n  base: {{type: bass}}\n")
    assert data(capsys, ".", code=0) == data(capsys, "r.urdf", code=0)


def test_errors_that_keep_a_body_from_being_read_are_told(capsys: pytest.CaptureFixture[str], home: Path) -> None:
    (home / "robot.yaml").write_text(ROBOT)
    told = data(capsys, ".", code=1)
    assert ([finding["code"] for finding in told["findings"]], set(told)) == (["RBX1301"], {"error", "findings"})
    (home / "r.urdf").write_text(WRONG)
    for path in (".", "r.urdf"):
        assert [finding["code"] for finding in data(capsys, path, code=1)["findings"]] == ["RBX2003"]
        assert "error[RBX2003]" in checked(capsys, path, code=1)


def test_what_has_no_body_is_told_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert "error[RBX2008]" in checked(capsys, str(ROOT / "robots/rooms"), code=1)
