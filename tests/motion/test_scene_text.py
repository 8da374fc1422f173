"""Scene files of MoveIt: what is written is read again as it was, and what is wrong is told with its line."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Finding
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.motion.scene_text import SceneFile, read_scene, written_scene
from tests.loops import for_all
from tests.motion.scenes import FACES, MESH, names, objects

OLDER = """(noname)
* table
1
box
0.2 0.7 0.01
0.5 0 0.4
0 0 0 1
0.8 0.4 0 1
* two balls
2
sphere
0.05
0 0 0
0 0 0 1
0 0 0 0
sphere
0.1
0 0 0.2
0 0 0 1
0 0 0 0
.
"""
NEWER = """house
* table
0.5 0 0.4
0 0 0 1
1
box
0.2 0.7 0.01
0 0 0
0 0 0 1
0.8 0.4 0 1
1
edge
0.1 0 0
0 0 0 1
.
"""


def read(text: str) -> SceneFile:
    found = read_scene(text, "a.scene")
    assert isinstance(found, SceneFile), found
    return found


@given(st.data(), st.lists(names, max_size=4, unique=True))
def test_what_is_written_is_read_as_it_was(data: st.DataObject, chosen: list[str]) -> None:
    found = tuple(replace(data.draw(objects(name)), link="") for name in chosen)
    assert read(written_scene("shelf", found)) == SceneFile("shelf", found)


def test_both_variants_say_the_same() -> None:
    older, newer = read(OLDER), read(NEWER)
    assert [next(placed_object.all_pieces) for placed_object in (older.objects[0], newer.objects[0])] == [
        *newer.objects[0].all_pieces
    ] * 2
    assert newer.objects[0].pose.translation == (0.5, 0.0, 0.4)
    assert older.objects[0].colour == (0.8, 0.4, 0.0, 1.0)
    assert [placed_object.name for placed_object in older.objects] == ["table", "two balls"]
    assert older.objects[1].pieces[0].pose.translation == (0.0, 0.0, 0.2)


@pytest.mark.parametrize("text", [OLDER, NEWER], ids=["older", "newer"])
def test_reading_and_writing_once_more_changes_nothing(text: str) -> None:
    once = written_scene("a", read(text).objects)
    assert written_scene("a", read(once).objects) == once


@for_all(
    "old, new, line, message",
    [
        ("box", "bax", 6, "'bax' is no shape: box"),
        ("0.2 0.7 0.01", "0.2 x 0.01", 7, "'x' is no number, but y of a box"),
        ("0.2 0.7 0.01", "0.2 nan 0.01", 7, "'nan' is no number"),
        ("0.2 0.7 0.01", "0.2 0.7 0", 6, "0 m"),
        ("0 0 0 1\n1\nbox", "0 0 0 0\n1\nbox", 4, "the length of this quaternion is 0"),
        ("1\nbox", "0\nbox", 2, "'table' has no shapes"),
        ("1\nbox", "-1\nbox", 5, "'-1' is no number of shapes"),
        ("0.8 0.4 0 1", "0.8 4 0 1", 10, "from 0 to 1"),
        ("\n.\n", "\n", 14, "the file ends where '*' or '.' belongs"),
        ("* table", "table", 2, "'table' is neither"),
        ("* table", "*", 2, "the object has no name"),
        (NEWER[6:-2], NEWER[6:-2] + NEWER[6:-2], 15, "'table' is there twice"),
        ("box\n0.2 0.7 0.01", "mesh\n1 1\n0 0 0\n0 1 0", 9, "'1' is no corner of a triangle: 0 to 0"),
        ("box\n0.2 0.7 0.01", "mesh\n999999999 1", 7, "'999999999' is no number of corners"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(old: str, new: str, line: int, message: str) -> None:
    assert old in NEWER
    found = read_scene(NEWER.replace(old, new, 1), "a.scene")
    assert isinstance(found, Finding)
    assert (found.code, found.span and found.span.line) == ("RBX2351", line)
    assert message in found.message


@given(st.text("*.\n 01-box sphere mesh\0é", max_size=60))
def test_any_text_is_a_scene_or_a_finding(text: str) -> None:
    assert isinstance(read_scene(text, "a.scene"), SceneFile | Finding)


def test_a_mesh_is_written_in_metres() -> None:
    shape = replace(_mesh().shape, size=(0.001, 0.001, 0.002))
    (back,) = read(written_scene("a", [replace(_mesh(), shape=shape)])).objects
    assert back.shape.size == (1.0, 1.0, 1.0)
    assert (back.shape.points[3], back.shape.points[11]) == (0.2 * 0.001, 0.2 * 0.002)
    assert back.shape.triangles == FACES


def _mesh() -> PlacedObject:
    return PlacedObject("rock", MESH, "", read(NEWER).objects[0].pose)
