"""Robots have the places of their world."""

from __future__ import annotations

from pathlib import Path

from rbxcompose.base.config import Place
from rbxcompose.testing.manifests import Checked
from tests.parts.project import Project

WORLD = """rbx: 1
kind: World
name: flat
places:
  door: {x: 1 m, y: 2 m, colour: red}
  bed: {x: 3 m, y: 2 m}
"""
MISSION = "rbx: 1\nkind: Mission\nname: walk\ndo:\n  - go_to: door\n  - go_to: bed\n"
ROBOT = """world: ../../flat.yaml
components:
  base: {type: diff_drive_sim}
  go_to: {type: go_to}
missions: {walk: ../../walk.yaml}
"""


def checked(folder: Path, world: str, robot: str = ROBOT) -> Checked:
    (folder / "flat.yaml").write_text(world, encoding="utf-8")
    (folder / "walk.yaml").write_text(MISSION, encoding="utf-8")
    return Project(folder).check(robot)


def test_a_robot_has_the_places_of_its_world_beside_its_own_which_win(tmp_path: Path) -> None:
    found = checked(tmp_path, WORLD, f"{ROBOT}places: {{bed: {{x: 5 m, y: 0 m}}, desk: {{x: 0 m, y: 1 m}}}}\n")
    assert found.compilation.robot is not None, found.text
    assert dict(found.compilation.robot.manifest.places) == {
        "door": Place("door", 1.0, 2.0, 0.0, "red"),
        "bed": Place("bed", 5.0, 0.0, 0.0),
        "desk": Place("desk", 0.0, 1.0, 0.0),
    }


def test_a_place_that_neither_has_is_found_but_not_if_the_world_cannot_be_read(tmp_path: Path) -> None:
    assert "there is no place 'bed'" in checked(tmp_path, WORLD.replace("  bed", "  cot")).text
    lost = checked(tmp_path, WORLD, ROBOT.replace("flat.yaml", "lost.yaml")).text
    assert "lost.yaml" in lost
    assert "no place" not in lost
