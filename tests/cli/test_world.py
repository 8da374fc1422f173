"""`rbxcompose world` and `rbxcompose map`: what is in a world, its picture, and the map of a robot that runs."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbxcompose.commands.main import main
from rbxcompose.domains.worlds.commands.map import base_of, write_map
from rbxcompose.domains.worlds.grid_map import read_map
from rbxcompose.testing.golden import Golden
from tests.cli.live_robot import Robot
from tests.conftest import ROOT

HOUSE = str(ROOT / "worlds/house.yaml")
EMPTY = "rbx: 1\nkind: World\nname: field\n"


def told(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    assert main(["world", *words]) == code
    out, err = capsys.readouterr()
    return out + err


@pytest.mark.parametrize("name", ["house", "visitor"])
def test_a_world_is_shown(name: str, golden: Golden, repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    golden.check(f"world_{name}.txt", told(capsys, "show", f"worlds/{name}.yaml"))


def test_a_robot_shows_its_world_and_another_one_by_an_option(capsys: pytest.CaptureFixture[str]) -> None:
    robot = str(ROOT / "robots/house")
    assert told(capsys, robot) == told(capsys, HOUSE) == told(capsys, "rbx:worlds/house")
    assert told(capsys, robot, "--world", "rbx:worlds/visitor").startswith("visitor: ")


def test_json_has_all_of_it_in_si_units(capsys: pytest.CaptureFixture[str]) -> None:
    data: dict[str, Any] = json.loads(told(capsys, HOUSE, "--json"))
    assert data["map"]["size"] == [8.0, 6.0]
    assert data["objects"]["sofa"]["size"] == [1.8, 0.8, 0.8]
    assert list(data["spawn"]) == ["dock", "door"]
    assert data["places"]["kitchen"] == {"x": 6.5, "y": 4.8, "heading": pytest.approx(-np.pi / 2), "colour": "green"}


def test_what_is_no_world_is_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert "RBX3640" in told(capsys, str(ROOT / "robots/turtlebot"), code=1)
    (tmp_path / "wrong.yaml").write_text(f"{EMPTY}map: nowhere.yaml\n")
    assert "RBX1301" in told(capsys, str(tmp_path / "wrong.yaml"), code=1)
    assert "RBX1301" in told(capsys, str(tmp_path / "none.yaml"), code=1)
    (tmp_path / "twice.yaml").write_text(f"{EMPTY}places: {{a: {{x: 1 m}}, a: {{x: 2 m}}}}\n")
    (tmp_path / "robot.yaml").write_text("rbx: 1\nkind: Robot\nname: r\nworld: twice.yaml\n")
    for action in ("show", "picture"):
        assert "RBX1104" in told(capsys, action, str(tmp_path / "twice.yaml"), code=1)
        assert "RBX1104" in told(capsys, action, str(tmp_path / "robot.yaml"), code=1)


def test_a_picture_has_the_form_that_its_name_says(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("field.yaml").write_text(EMPTY)
    assert told(capsys, "picture", "field.yaml") == "wrote field.png\n"
    assert Path("field.png").read_bytes().startswith(b"\x89PNG")
    told(capsys, "picture", "field.yaml", "-o", "field.svg")
    assert Path("field.svg").read_text().startswith("<svg ")
    told(capsys, "picture", "field.yaml", "-o", "field.bmp", code=2)
    assert not Path("field.bmp").exists()


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(base, "rbx: 1\nkind: Robot\nname: mapped\nnavigation: {map: rbx:worlds/house_map.yaml}\n")
    up = made.do("up", "-d", str(made.file), "--set", "bus.port=7893")
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


def test_the_map_of_a_robot_that_runs_is_saved_as_it_is(robot: Robot, tmp_path: Path) -> None:
    done = robot.do("map", "save", "-o", str(tmp_path / "new/house.yaml"))
    assert done.returncode == 0, done.stderr
    saved, known = read_map(tmp_path / "new/house.yaml"), read_map(ROOT / "worlds/house_map.yaml")
    assert (saved.cells == known.cells).all()
    assert (saved.resolution, saved.origin) == (known.resolution, known.origin)
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["house.pgm", "house.yaml"]


def test_a_map_is_replaced_only_by_force(robot: Robot, tmp_path: Path) -> None:
    (tmp_path / "m.pgm").write_text("mine")
    done = robot.do("map", "save", "-o", str(tmp_path / "m"))
    assert (done.returncode, "RBX9101" in done.stderr, "--force" in done.stderr) == (1, True, True)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]
    assert robot.do("map", "save", "-o", str(tmp_path / "m"), "--force").returncode == 0
    assert read_map(tmp_path / "m.yaml").cells.shape == (120, 160)


def test_what_is_no_map_is_not_saved(robot: Robot, tmp_path: Path) -> None:
    done = robot.do("map", "save", "-o", str(tmp_path / "m"), "--topic", "plan")
    assert (done.returncode, "RBX3641" in done.stderr) == (1, True)
    assert not list(tmp_path.iterdir())


def test_a_map_is_shown(robot: Robot) -> None:
    shown = robot.told("map", "show")
    assert (shown["cells"], shown["resolution"], shown["unknown"]) == ([160, 120], 0.05, 0.0)
    assert robot.do("map").stdout.startswith("8 m x 6 m, 160 x 120 cells of 0.05 m")


def test_a_map_in_a_folder_has_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "house").mkdir()
    for out in ("", ".", "./", ".yaml"):
        assert base_of(out) == Path("map")
    assert base_of("..") == base_of("../") == Path("../map")
    assert base_of("house") == base_of("house/") == Path("house/map")
    assert base_of("new/") == Path("new/map")
    assert base_of("house.yaml") == base_of("house.pgm") == Path("house")


def test_a_map_that_cannot_be_written_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert write_map(read_map(ROOT / "worlds/house_map.yaml"), tmp_path / "file/m") == 2
    assert "cannot be written" in capsys.readouterr().err
