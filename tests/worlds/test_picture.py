"""A picture of a world shows all that is in it, where it is."""

from __future__ import annotations

import io
import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from rbxcompose.base.config import Place
from rbxcompose.base.findings import Report, Span
from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.grid_map import OCCUPIED, UNKNOWN, GridMap
from rbxcompose.domains.worlds.picture import PictureView, marks_of, placed, png_of, svg_of, view_of
from rbxcompose.domains.worlds.world import no_walls
from rbxcompose.domains.worlds.world_file import WorldFile, WorldObjectModel, read_world
from rbxcompose.manifest.documents import Documents
from tests.conftest import ROOT
from tests.soak import rare

NUMBERS = st.floats(-20, 20)
POSES = st.builds(Pose2, NUMBERS, NUMBERS, st.floats(-math.pi, math.pi))


def world(name: str) -> WorldFile:
    path = ROOT / f"worlds/{name}.yaml"
    found = read_world(path, Documents(Report(), {}), Span(str(path), 1, 1, 1, 1))
    assert found is not None
    return found


def with_grid(grid: GridMap, **things: object) -> WorldFile:
    objects = {name: WorldObjectModel.model_validate(thing) for name, thing in things.items()}
    return WorldFile("made", Path("map.yaml"), grid, objects, {}, {}, {})


@pytest.mark.parametrize("name", ["house", *rare("blank", "visitor")])
def test_both_kinds_of_picture_have_the_same_size_and_name_everything(name: str) -> None:
    shown = world(name)
    root = ElementTree.fromstring(svg_of(shown))
    image = Image.open(io.BytesIO(png_of(shown)))
    assert root.get("viewBox") == f"0 0 {image.width} {image.height}"
    assert max(image.size) == 1000
    texts = sorted(element.text or "" for element in root.iter() if element.tag.endswith("text"))
    assert texts == sorted([*shown.objects, *shown.spawn, *shown.places])


@given(POSES, POSES, st.floats(0.05, 1))
def test_all_is_within_the_picture_whatever_the_turn_of_the_map(at: Pose2, spawn: Pose2, resolution: float) -> None:
    grid = GridMap(np.zeros((3, 5), np.int8), resolution, at)
    shown = WorldFile("made", Path("map.yaml"), grid, {}, {}, {"s": spawn}, {"p": Place("p", 1.0, 2.0, 0.5, "")})
    view = view_of(shown, list(marks_of(shown)))
    corners = [*grid.to_points([(0, 0), (5, 0), (0, 3), (5, 3)]), (spawn.x, spawn.y), (1.0, 2.0)]
    pixels = view.pixels(np.array(corners))
    assert (pixels >= 0).all()
    assert (pixels <= (view.width, view.height)).all()


@settings(max_examples=settings().max_examples // 2)
@given(POSES, st.integers(0, 3), st.integers(0, 5))
def test_a_cell_has_its_colour_at_its_middle(at: Pose2, row: int, column: int) -> None:
    cells = np.zeros((4, 6), np.int8)
    cells[row, column], cells[row - 1, column] = OCCUPIED, UNKNOWN
    shown = with_grid(GridMap(cells, 0.5, at))
    view = view_of(shown, [])
    image = np.asarray(Image.open(io.BytesIO(png_of(shown))))
    seen = view.pixels(shown.grid.to_points(np.array([(column, row), (column, (row - 1) % 4)]) + 0.5)).astype(int)
    assert [int(image[y, x, 0]) for x, y in seen] == [0x30, 0xC8]


def test_the_walls_of_a_vector_picture_are_the_cells() -> None:
    cells = np.zeros((2, 4), np.int8)
    cells[1, 1:3] = cells[0, 3] = OCCUPIED
    paths = [element.get("d") for element in ElementTree.fromstring(svg_of(with_grid(GridMap(cells, 1.0)))).iter()]
    assert [path for path in paths if path] == ["M3 0h1v1h-1zM1 1h2v1h-2z"]


def test_what_moves_is_drawn_where_it_begins_with_its_path() -> None:
    path = [[0, 1.0, 2.0], [5, 3.0, 2.0]]
    shown = with_grid(no_walls(), guard={"shape": "person", "path": path, "colour": "red"})
    line, area, *_ = marks_of(shown)
    assert line.points.tolist() == [[1.0, 2.0], [3.0, 2.0]]  # type: ignore[union-attr]
    assert np.allclose(area.points.mean(0), (1.0, 2.0))  # type: ignore[union-attr]


def test_a_word_that_is_no_colour_is_drawn_nevertheless_and_never_becomes_markup() -> None:
    for colour in ("sparkling", '"/><script>'):
        shown = with_grid(no_walls(), thing={"box": [1, 1, 1], "colour": colour})
        assert png_of(shown)
        assert "script" not in svg_of(shown)


@given(POSES, st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=5))
def test_points_are_placed_as_poses_compose(pose: Pose2, points: list[tuple[float, float]]) -> None:
    expected = [(there.x, there.y) for there in (pose.compose(Pose2(x, y)) for x, y in points)]
    assert np.allclose(placed(np.array(points), pose), expected)


def test_up_in_the_world_is_up_in_the_picture() -> None:
    assert PictureView(0.0, 2.0, 10.0, 20, 20).pixels(np.array([(0.0, 2.0), (1.0, 0.0)])).tolist() == [[0, 0], [10, 20]]
