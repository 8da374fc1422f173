"""A new world."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rbxcompose.commands.main import main
from rbxcompose.domains.worlds.grid_map import SOLID, read_map
from rbxcompose.testing import check_text
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.scaffold import world_files


def test_it_is_written_as_people_would_write_it(golden: Golden) -> None:
    golden.check("world/worlds/office.yaml.txt", world_files("office")["worlds/office.yaml"])


def test_a_robot_drives_in_it_without_findings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "world", "office", "--yes"]) == 0
    robot = (
        "rbx: 1\nkind: Robot\nname: r\nworld: ../../worlds/office.yaml\ncomponents: {base: {type: diff_drive_sim}}\n"
    )
    others = {f"../../{name}": text for name, text in world_files("office").items()}
    checked = check_text(robot, tmp_path / "robots/r", others=others)
    assert set(checked.codes) <= set(
        check_text(robot.replace("world: ../../worlds/office.yaml\n", ""), tmp_path / "bare").codes
    )
    assert "world" in {instance.name for instance in checked.plan.instances}


def test_its_map_has_walls_all_around_and_nothing_else(tmp_path: Path) -> None:
    for name, text in world_files("office").items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    grid = read_map(tmp_path / "worlds/office_map.yaml")
    inside = grid.cells[1:-1, 1:-1]
    assert (grid.cells >= SOLID).sum() == grid.cells.size - inside.size
    assert not np.any(inside)
