"""Parts of a robot added, attached elsewhere and removed, with what the robot then looks like."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.requests import Refused
from tests.loops import for_all
from tests.robot_editor.test_robot_editor import Refuser, ask, editor_of, save, written

BUILT = """rbx: 1
kind: Robot
name: looker
include:
  base: rbx:parts/box_base.yaml
  torso:
    part: rbx:parts/torso.yaml
    attach:
      to: base_top   # on the lid
      at: {x: -10 cm}
  camera: {part: rbx:parts/xtion.yaml, attach: {to: torso_top}}   # looks ahead
  teleop: rbx:parts/teleop.yaml
"""
POLE = """rbx: 1
kind: Part
name: pole
about: A pole.
args:
  height: {type: length}
body:
  xacro: rbx:parts/body/torso.urdf.xacro
  with: {height: "${args.height}"}
"""
XTION = "rbx:parts/xtion.yaml"


FILES = {"robots/fetcher/robot.yaml": BUILT, "parts/pole.yaml": POLE}


@pytest.fixture
def project(tmp_path: Path) -> Path:
    return written(tmp_path, FILES)


@pytest.fixture(scope="module")
def refuser(tmp_path_factory: pytest.TempPathFactory) -> Refuser:
    return Refuser(written(tmp_path_factory.mktemp("refused"), FILES), "include")


def part(name: str, op: str = "set", **values: Any) -> dict[str, Any]:
    return {"op": op, "path": ["include", name], **({"values": values} if values else {})}


def text_of(project: Path) -> str:
    return (project / "robots/fetcher/robot.yaml").read_text(encoding="utf-8")


def look(project: Path, *changes: dict[str, Any]) -> Any:
    return ask(editor_of(project), "look", *changes, subject="include")


def test_parts_are_told_with_what_carries_them(project: Path) -> None:
    told = look(project)
    assert [(one["name"], one["to"], one["pose"]["x"]) for one in told["entries"]] == [
        ("base", "", "0 m"),
        ("torso", "base_top", "-10 cm"),
        ("camera", "torso_top", "0 m"),
        ("teleop", "", "0 m"),
    ]
    assert "torso_top" in told["links"]
    assert (told["ghosts"], told["gone"]) == ([], [])
    assert {one["why_not"] for one in told["entries"]} == {""}


def test_parts_of_the_library_and_of_the_project_are_offered_with_what_they_need(project: Path) -> None:
    offered = {one["file"]: one for one in editor_of(project).answer({"do": "robot/palette"})}
    assert offered[XTION]["about"].startswith("A depth camera")
    assert offered[XTION]["has_body"] is True
    pole = {"name": "pole", "about": "A pole.", "file": "../../parts/pole.yaml", "has_body": True, "needs": ("height",)}
    assert offered["../../parts/pole.yaml"] == pole
    assert "robot.yaml" not in offered


def test_a_part_is_seen_on_the_robot_before_it_is_saved(project: Path) -> None:
    added = part("eye", "add", part=XTION, to="torso_top", z=0.1, yaw=math.pi / 2)
    told = look(project, added)
    assert told["errors"] == 0
    assert told["ghosts"]
    assert all(link.startswith("eye_") for link in told["ghosts"])
    assert 'name="eye_' in told["model"]["urdf"]
    assert text_of(project) == BUILT
    save(editor_of(project), added, subject="include")
    line = "  eye: {part: rbx:parts/xtion.yaml, attach: {to: torso_top, at: {z: 0.1 m, yaw: 90 deg}}}\n"
    assert text_of(project) == BUILT + line


def test_a_part_gets_what_it_needs(project: Path) -> None:
    told = look(project, part("pole", "add", part="../../parts/pole.yaml", to="base_top"))
    assert "height" in next(one["message"] for one in told["findings"] if one["is_new"])
    given = part("pole", "add", part="../../parts/pole.yaml", to="base_top", **{"with": {"height": "80 cm"}})
    assert look(project, given)["errors"] == 0


def test_what_a_part_carries_moves_with_it_and_texts_around_stay(project: Path) -> None:
    moved = part("torso", x=0.05, pitch=math.radians(-5))
    told = look(project, moved)
    assert {"torso_link", "torso_top", "camera_link"} <= set(told["ghosts"])
    assert not any(link.startswith("base_") for link in told["ghosts"])
    save(editor_of(project), moved, subject="include")
    assert text_of(project) == BUILT.replace("{x: -10 cm}", "{x: 5 cm, pitch: -5 deg}")


def test_an_attachment_is_made_where_none_was_written(project: Path) -> None:
    save(editor_of(project), part("camera", z=0.02), part("camera", to="base_top"), subject="include")
    after = BUILT.replace("attach: {to: torso_top}", "attach: {to: base_top, at: {z: 2 cm}}")
    assert text_of(project).replace("0.02 m", "2 cm") == after
    save(editor_of(project), part("teleop", to="base_top", x="1 cm"), subject="include")
    assert "  teleop: {part: rbx:parts/teleop.yaml, attach: {to: base_top, at: {x: 1 cm}}}\n" in text_of(project)


def test_a_part_is_taken_off_and_what_it_carried_is_named(project: Path) -> None:
    told = look(project, part("torso", "remove"))
    assert any("torso_top" in one["message"] for one in told["findings"] if one["is_new"])
    save(editor_of(project), part("camera", "remove"), subject="include")
    assert text_of(project) == "".join(line for line in BUILT.splitlines(True) if "camera" not in line)


@for_all(
    "change, why",
    [
        (part("base", "add", part=XTION, to="torso_top"), "it is taken"),
        (part("Big Eye", "add", part=XTION, to="torso_top"), "cannot be the name"),
        (part("eye", "add", part="/etc/passwd"), "there is no part"),
        (part("eye", "add", part="rbx:parts/../robots/turtlebot/robot.yaml"), "there is no part"),
        (part("eye", "add", to="torso_top"), "which part"),
        (part("eye", "add", part=XTION, x=1), "choose the link"),
        (part("eye", "add", part=XTION, to="a: b"), "must be the name of a link"),
        (part("eye", "add", part=XTION, to="torso_top", x=math.nan), "finite"),
        (part("eye", "add", part=XTION, to="torso_top", x=1e9), "farther away"),
        (part("eye", "add", part=XTION, to="torso_top", scale=2), "a pose has"),
        (part("eye", "add", part=XTION, **{"with": {"baseline": "1 m}, attach: {to: x"}}), "must be a word"),
        (part("torso", part=XTION), "the link that carries it and its pose"),
        (part("torso", yaw="90"), "unit is missing"),
        (part("nothing", x=1), "there is no part 'nothing'"),
        ({"op": "rename", "path": ["include", "torso"], "name": "trunk"}, "only values can be changed"),
    ],
)
def test_what_is_no_change_of_a_part_is_refused(refuser: Refuser, change: dict[str, Any], why: str) -> None:
    with pytest.raises(Refused, match=why):
        refuser.save(change)
    assert text_of(refuser.project) == BUILT


def test_a_link_that_is_not_there_is_found(project: Path) -> None:
    told = look(project, part("camera", to="torso_tpo"))
    assert any("torso_tpo" in one["message"] for one in told["findings"] if one["is_new"])
