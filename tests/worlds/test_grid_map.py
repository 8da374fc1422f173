"""Maps: points and cells, and the files of map_server."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.grid_map import GridMap, MapError, grid_from, map_files, read_map
from tests.loops import for_all
from tests.worlds.scenes import ANGLES, Points, grids, inside

YAML = {
    "image": "map.pgm",
    "resolution": "0.05",
    "origin": "[-1.0, -2.5, 0.3]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}
GREY = np.array([[0, 100, 254], [205, 255, 50]], np.uint8)
P5 = b"P5\n3 2\n255\n" + GREY.tobytes()
P2 = b"P2 # of a robot\n# 7 7\n3 2 255\n0 100 254 # the upper row\n205 255\n50"
WIDE = b"P5 3 2 65535\n" + (GREY.astype(">u2") * 257).tobytes()


def written(folder: Path, image: bytes = P5, entries: Mapping[str, str] = YAML) -> Path:
    """Write a map, and return the path of its YAML."""
    (folder / "map.pgm").write_bytes(image)
    (folder / "map.yaml").write_text("".join(f"{key}: {value}\n" for key, value in entries.items()))
    return folder / "map.yaml"


@given(grids(), st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=30))
def test_points_and_cells_are_the_same_places(grid: GridMap, places: list[tuple[float, float]]) -> None:
    points = np.array(places)
    np.testing.assert_allclose(grid.to_points(grid.to_cells(points)), points, atol=1e-9)
    occupied = grid.occupied_at(points)
    assert not (occupied & ~inside(grid, (), points, 1e-9)).any()
    assert not (~occupied & inside(grid, (), points, -1e-9)).any()
    columns = np.arange(grid.cells.shape[1])
    middles = grid.to_points(np.stack((columns + 0.5, np.full(columns.shape, 0.5)), -1))
    assert grid.occupied_at(middles).tolist() == (grid.cells[0] == 100).tolist()
    assert grid.contains(middles).all()
    assert not grid.contains(grid.to_points(np.stack((columns + 0.5, np.full(columns.shape, -0.5)), -1))).any()


def test_nothing_is_occupied_beside_a_map_or_nowhere() -> None:
    full = GridMap(np.full((2, 2), 100, np.int8), 1.0)
    assert full.occupied_at([(-0.1, 1), (1, 2.1), (math.nan, 1), (1e300, 1), (1, 1)]).tolist() == [False] * 4 + [True]


CELLS = st.integers(1, 6).flatmap(
    lambda columns: st.lists(st.lists(st.integers(-1, 100), min_size=columns, max_size=columns), min_size=1, max_size=6)
)
NUMBERS = st.floats(-1e6, 1e6)


@given(CELLS, st.booleans(), st.floats(1e-3, 1e3), st.builds(Pose2, NUMBERS, NUMBERS, ANGLES))
def test_a_map_that_was_saved_is_read_again(
    tmp_path_factory: pytest.TempPathFactory, rows: list[list[int]], thirds: bool, resolution: float, origin: Pose2
) -> None:
    cells = np.array(rows, np.int8)
    if thirds:
        cells = np.where(cells > 60, 100, np.where(cells > 30, 0, -1)).astype(np.int8)
    folder = tmp_path_factory.mktemp("map")
    for name, data in map_files(GridMap(cells, resolution, origin), "my: map").items():
        (folder / name).write_bytes(data)
    found = read_map(folder / "my: map.yaml")
    assert found.cells.tolist() == cells.tolist()
    assert (found.resolution, found.origin) == (resolution, origin)


@given(st.integers(0, 255), st.booleans(), st.floats(0, 0.5), st.floats(0.5, 1), st.sampled_from(["trinary", "scale"]))
def test_a_grey_becomes_what_the_format_says(grey: int, negate: bool, low: float, high: float, mode: str) -> None:
    taken = grey / 255 if negate else (255 - grey) / 255
    grid = grid_from(np.array([[grey]]), 1.0, Pose2(), occupied_thresh=high, free_thresh=low, negate=negate, mode=mode)
    value = int(grid.cells[0, 0])
    if abs(taken - low) > 1e-9 and abs(taken - high) > 1e-9:
        between = round((taken - low) / (high - low) * 100) if low < taken < high and mode == "scale" else -1
        assert value == (100 if taken > high else 0 if taken < low else between)


@pytest.mark.parametrize("image", [P5, P2, WIDE])
def test_all_kinds_of_pgm_are_the_same_map_and_the_lowest_row_is_first(tmp_path: Path, image: bytes) -> None:
    grid = read_map(written(tmp_path, image))
    assert grid.cells.tolist() == [[-1, 0, 100], [100, -1, 0]]
    assert (grid.resolution, grid.origin) == (0.05, Pose2(-1.0, -2.5, 0.3))
    raw = read_map(written(tmp_path, image, {**YAML, "mode": "raw"}))
    assert raw.cells.tolist() == [[-1, -1, 50], [0, 100, -1]]


def stacked(*channels: NDArray[np.uint8]) -> Image.Image:
    """Return a picture with these channels."""
    return Image.fromarray(np.stack(channels, -1))


FULL = np.full_like(GREY, 255)
PNGS = {
    "grey": Image.fromarray(GREY),
    "wide": Image.fromarray(GREY.astype(np.uint16) * 257),
    "colours": stacked(GREY, GREY, GREY),
    "palette": Image.fromarray(GREY).convert("P"),
}


@pytest.mark.parametrize("kind", PNGS)
def test_a_png_is_the_same_map(tmp_path: Path, kind: str) -> None:
    path = written(tmp_path)
    PNGS[kind].save(tmp_path / "map.pgm", "PNG")
    assert read_map(path).cells.tolist() == [[-1, 0, 100], [100, -1, 0]]


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_a_png_of_few_bits_is_black_and_white(tmp_path: Path, bits: int) -> None:
    path = written(tmp_path)
    picture = Image.fromarray(np.array([[0, 1, 1], [1, 1, 0]], np.uint8))
    picture.putpalette([0, 0, 0, 255, 255, 255])
    (picture.convert("1") if bits == 1 else picture).save(tmp_path / "map.pgm", "PNG", bits=bits)
    assert read_map(path).cells.tolist() == [[0, 0, 100], [100, 0, 0]]


def test_alpha_is_one_more_colour_unless_it_hides_what_is_known(tmp_path: Path) -> None:
    path = written(tmp_path)
    stacked(GREY, GREY, GREY, FULL).save(tmp_path / "map.pgm", "PNG")
    assert read_map(path).cells.tolist() == [[0, 0, -1], [100, -1, 0]]  # 205 counts as (3 * 205 + 255) / 4
    written(tmp_path, entries={**YAML, "mode": "scale"})
    stacked(GREY, np.array([[255, 255, 254], [255, 0, 255]], np.uint8)).save(tmp_path / "map.pgm", "PNG")
    assert read_map(path).cells.tolist() == [[0, -1, 100], [100, 91, -1]]


@for_all(
    "image, words",
    [
        (b"", "neither"),
        (b"P6\n3 2\n255\n" + bytes(18), "neither"),
        (b"P5\n3", "header"),
        (P5[:-1], "truncated: 5 of 3 x 2"),
        (WIDE[:-1], "truncated: 5 of 3 x 2"),
        (b"P2 3 2 255 1 2 3", "truncated: 3 of"),
        (b"P2 1 1 255 1.5", "not a number"),
        (b"P2 1 1 255 -1", "not a number"),
        (b"P2 1 1 255 99999999999999", "not a number"),
        (b"P2 1 1 200 201", "brighter"),
        (b"P5 0 2 255 ", "cells, not 0 x 2"),
        (b"P5 99999 99999 255 ", "cells, not 99999 x 99999"),
        (b"P5 1 1 0 1", "white"),
        (b"P5 1 1 65536 11", "white"),
        (b"\x89PNG\r\n\x1a\n", "cannot be read"),
    ],
)
def test_a_wrong_picture_is_explained(tmp_path: Path, image: bytes, words: str) -> None:
    with pytest.raises(MapError, match=words):
        read_map(written(tmp_path, image))


@for_all(
    "key, value, words",
    [
        ("image", "", "'image' is missing"),
        ("image", "gone.pgm", "cannot read gone.pgm: No such file"),
        ("image", "/dev/zero", "cannot read zero: it is not a regular file"),
        ("image", '"a\\0b"', "cannot read"),
        ("image", "/", "cannot read /: it is not a regular file"),
        ("image", "[1]", "'image' is missing"),
        ("resolution", ".nan", "'resolution' is a finite number"),
        ("resolution", "nan", "'resolution' is a finite number"),
        ("resolution", "-0.05", "at least 1 mm"),
        ("resolution", "1e-300", "at least 1 mm"),
        ("resolution", "1e15", "below 1e15 m"),
        ("resolution", "1\nresolution: 2", "'resolution' is written twice in map.yaml"),
        ("origin", "[0, 0]", "three numbers"),
        ("origin", "[0, [1], 0]", "'origin' is a list of three numbers"),
        ("origin", "[1e308, 0, 0]", "finite numbers below 1e15"),
        ("origin", "[0, 0, inf]", "finite"),
        ("negate", "perhaps", "0 or 1"),
        ("occupied_thresh", "65", "in order"),
        ("free_thresh", "0.7", "in order"),
        ("mode", "binary", "trinary, scale, raw"),
        ("image", "[", "not YAML"),
    ],
)
def test_a_wrong_entry_is_explained(tmp_path: Path, key: str, value: str, words: str) -> None:
    with pytest.raises(MapError, match=words):
        read_map(written(tmp_path, entries={**YAML, key: value}))


@pytest.mark.parametrize("key", YAML)
def test_a_missing_entry_is_named(tmp_path: Path, key: str) -> None:
    with pytest.raises(MapError, match=f"'{key}' is"):
        read_map(written(tmp_path, entries={name: value for name, value in YAML.items() if name != key}))


@pytest.mark.parametrize("data", [b"", b"a", b"\xff\xfe\x00", b"- 1", b"a: &a [*a]", b"x" * 200_000])
def test_what_is_no_description_of_a_map_is_explained(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "map.yaml").write_bytes(data)
    with pytest.raises(MapError):
        read_map(tmp_path / "map.yaml")


@settings(max_examples=60)
@given(st.sampled_from(["yaml", "pgm"]), st.sampled_from([P5, P2, WIDE, b"png"]), st.integers(0), st.binary(max_size=4))
def test_damage_is_explained_or_harmless(
    tmp_path_factory: pytest.TempPathFactory, which: str, image: bytes, place: int, noise: bytes
) -> None:
    path = written(tmp_path_factory.mktemp("damaged"), image)
    if image == b"png":
        PNGS["colours"].save(path.with_suffix(".pgm"), "PNG")
    damaged = path.with_suffix(f".{which}")
    data = damaged.read_bytes()
    place %= len(data)
    damaged.write_bytes(data[:place] + noise + data[place + len(noise) :])
    with suppress(MapError):
        assert read_map(path).cells.size


@pytest.mark.parametrize(
    ("cells", "resolution", "origin"),
    [
        (np.zeros((2, 2)), 1.0, Pose2()),
        (np.zeros(4, np.int8), 1.0, Pose2()),
        (np.zeros((0, 4), np.int8), 1.0, Pose2()),
        (np.broadcast_to(np.int8(0), (20_000, 20_000)), 1.0, Pose2()),
        (np.zeros((2, 2), np.int8), math.nan, Pose2()),
        (np.zeros((2, 2), np.int8), 1.0, Pose2(math.inf)),
        (np.zeros((2, 2), np.int8), 1.0, Pose2(0.0, -1e15)),
    ],
)
def test_no_map_has_wrong_numbers(cells: Points, resolution: float, origin: Pose2) -> None:
    with pytest.raises(MapError):
        GridMap(cells, resolution, origin)  # type: ignore[arg-type]
