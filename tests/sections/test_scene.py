"""The scene of a manifest: what its things become, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.loops import for_all
from tests.parts.project import Project

ROBOT = """
buses: {servos: {type: dynamixel}}
include:
  arm: {part: "rbx:parts/servo_arm.yaml", with: {bus: servos}}
"""
TABLE = "shelf\n* table\n0.5 0 0.4\n0 0 0 1\n1\nbox\n0.6 0.4 0.02\n0 0 0\n0 0 0 1\n0 0 0 0\n0\n.\n"
CUP = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"


def scene_of(project: Project) -> Any:
    assert project.checked
    [found] = [instance for instance in project.checked.plan.instances if instance.type == "scene"]
    return found.config


def test_things_of_a_manifest_and_of_a_file_are_there_from_the_start(tmp_path: Path) -> None:
    project = Project(tmp_path)
    scene = """
scene:
  file: ../../table.scene
  padding: 1 cm
  paddings: {arm_tip: 3 cm}
  objects:
    cup: {mesh: {file: ../../cup.stl, scale: 0.001}, at: {z: 42 cm}, colour: red}
    floor: {plane: below}
    bin: {cone: {radius: 5 cm, length: 10 cm}, frame: map}
"""
    project.check(ROBOT + scene, files={"table.scene": TABLE, "cup.stl": CUP})
    assert [finding.code for finding in project.findings] == ["RBX2379"]  # nobody tells where the arm is in `map`
    config = scene_of(project)
    assert [*config.objects] == ["cup", "floor", "bin", "table"]
    cup = config.objects["cup"].shapes[0]
    assert (Path(cup.file), cup.size) == (tmp_path / "cup.stl", (0.001,) * 3)
    assert config.objects["floor"].shapes[0].size == (0.0, 0.0, 1.0, 0.0)
    assert config.objects["table"].position == (0.5, 0.0, 0.4)
    assert (config.frames, config.objects["bin"].link) == (("map",), "map")
    assert (config.paddings["arm_tip"], config.paddings["arm_base_link"]) == (0.03, 0.01)


def test_each_cloud_runs_what_makes_a_thing_of_it(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(f"{ROBOT}scene: {{clouds: {{camera: {{topic: points, frame: map, cell: 3 cm}}}}}}\n")
    assert project.findings == []
    assert project.checked
    assert project.checked.plan
    config = scene_of(project)
    assert (config.clouds, config.frames) == (("camera",), ("map",))
    [mapper] = [instance for instance in project.checked.plan.instances if instance.type == "cloud_mapper"]
    made: Any = mapper.config
    assert (mapper.name, made.cell, made.frame) == ("scene_camera", 0.03, "map")


@for_all(
    "scene, code, words",
    [
        ("{file: ../../../table.scene}", "RBX1306", "outside the project"),
        ("{file: ../../tabel.scene}", "RBX1301", "does not exist"),
        ("{objects: {cup: {mesh: {file: ../../../cup.stl}}}}", "RBX1306", "outside the project"),
        ("{objects: {cup: {mesh: {file: ../../table.scene}}}}", "RBX2350", "is none of .stl"),
        ("{objects: {cup: {mesh: {file: ../../bad.stl}}}}", "RBX2350", "is no STL file"),
        ("{objects: {cup: {octree: {file: ../../bad.bt}}}}", "RBX2350", "'bad.bt' is no binary octree of OctoMap"),
        ("{objects: {cup: {octree: {file: ../../none.xyz}}}}", "RBX2350", "does not have three numbers in each line"),
        ("{file: ../../table.scene, objects: {table: {sphere: 1 cm}}}", "RBX2306", "'table' is an object of this"),
        ("{file: ../../cup.stl}", "RBX2351", "is neither '*'"),
        ("{objects: {a: {sphere: 1 cm, frame: mapp}}}", "RBX2019", "looks up the frame 'mapp'"),
        ("{objects: {a: {sphere: 1 cm, frame: map, link: arm_tip}}}", "RBX1003", "or in another 'frame'"),
        ("{objects: {a: {plane: below, link: arm_tip}}}", "RBX2306", "no link that moves can carry"),
        ("{objects: {a: {sphere: 1 cm, box: [1 cm, 1 cm, 1 cm]}}}", "RBX1003", "an object has one shape"),
        ("{objects: {a: {sphere: 1 cm, touches_objects: [b]}}}", "RBX1004", "'b'"),
        ("{objects: {a: {sphere: 1 cm, padding: 2 m}}}", "RBX1005", "padding"),
        ("{objects: {a: {mesh: {file: ../../cup.stl, scale: 0}}}}", "RBX1005", "scale"),
        ("{objects: {a: {sphere: 1 cm}}, clouds: {a: {topic: points}}}", "RBX2306", "an object of this scene"),
        ("{clouds: {arm_tip: {topic: points}}}", "RBX2306", "a link of the body"),
        ("{clouds: {a: {topic: points, range: 30 m}}}", "RBX1005", "range"),
    ],
)
def test_what_is_wrong_is_told(scene: str, code: str, words: str, tmp_path: Path) -> None:
    files = {"table.scene": TABLE, "cup.stl": CUP, **dict.fromkeys(("bad.stl", "bad.bt"), "<html>"), "none.xyz": ""}
    checked = Project(tmp_path).check(f"{ROBOT}scene: {scene}\n", files=files)
    assert (checked.codes, words in checked.text) == ([code], True), checked.text
