"""Maps of cells, and the files in which ROS's map_server keeps them: YAML beside a picture.

The format: https://wiki.ros.org/map_server and https://docs.nav2.org/configuration/packages/configuring-map-server.html
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import yaml

from rbxcompose.base.arrays import AnyArray, Array, ArrayLike, Bools, Indices, Ints8, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.base.findings import need
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.printable import plain
from rbxcompose.base.requests import Refused
from rbxcompose.base.units import MOST
from rbxcompose.manifest.yaml_nodes import compose

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
SOLID = 65  # a cell of at least this is a solid square, as for map_saver
MOST_CELLS = 100_000_000
SMALLEST = 1e-3  # [m] side of a cell
MOST_BYTES = 450_000_000  # of a picture: so many cells as text
MOST_TEXT = 100_000  # of the YAML [B]
MODES = ("trinary", "scale", "raw")
PGM_HEADER = re.compile(rb"P([25])" + rb"(?:\s|#[^\n]*\n)+(\d{1,9})" * 3 + rb"(?:#[^\n]*\n|\s)")
COMMENT = re.compile(rb"#[^\n]*")
YES_OR_NO = {"0": False, "1": True, "false": False, "true": True, "no": False, "yes": True, "off": False, "on": True}
WRITTEN = {"occupied_thresh": 0.65, "free_thresh": 0.196}  # by map_saver; its grey for unknown lies between them
GREYS = {OCCUPIED: 0, UNKNOWN: 205, FREE: 254}


class MapError(Refused):
    """Raised for a map that cannot be read, with a sentence that says why."""


@dataclass(frozen=True, slots=True, eq=False)
class GridMap:
    """A map of square cells, as nav_msgs/OccupancyGrid has it; its cells are never changed.

    Raises:
        MapError: if there are no cells or more than 100 million, they are smaller than 1 mm, or a number is not finite
            and below 1e15.
    """

    cells: Ints8
    """(rows, columns), the lowest y first: 0 is free, 100 occupied, -1 unknown, the rest are percents."""
    resolution: float
    """Side of a cell [m]."""
    origin: Pose2 = Pose2()
    """Pose of the lower left corner of the first cell in `map`."""

    def __post_init__(self) -> None:
        if self.cells.ndim != 2 or self.cells.dtype != np.int8:
            raise MapError(f"cells are a table of int8, not {self.cells.ndim}-dimensional {self.cells.dtype}")
        _check_size(*self.cells.shape[::-1])
        if not SMALLEST <= self.resolution < MOST:
            raise MapError(f"the resolution is at least 1 mm, and below 1e15 m, not {self.resolution}")
        origin = self.origin.x, self.origin.y, self.origin.heading
        if not all(abs(number) < MOST for number in origin):
            raise MapError(f"the origin is three finite numbers below 1e15, not {', '.join(map(str, origin))}")

    def to_cells(self, points: ArrayLike) -> Array:
        """Return points (..., 2) of `map` [m] as (column, row) counted in cells from the origin; whole at corners."""
        cos, sin = math.cos(self.origin.heading), math.sin(self.origin.heading)
        x, y = np.moveaxis(np.asarray(points, float), -1, 0)
        x, y = x - self.origin.x, y - self.origin.y
        return np.stack((cos * x + sin * y, cos * y - sin * x), -1) / self.resolution

    def to_points(self, cells: ArrayLike) -> Array:
        """Return (column, row) (..., 2) as points of `map` [m]: the inverse; add 0.5 to indices for the centres."""
        cos, sin = math.cos(self.origin.heading), math.sin(self.origin.heading)
        u, v = np.moveaxis(np.asarray(cells, float) * self.resolution, -1, 0)
        return np.stack((self.origin.x + cos * u - sin * v, self.origin.y + sin * u + cos * v), -1)

    def contains(self, points: ArrayLike) -> Bools:
        """Return for points (..., 2) of `map` [m] whether each is on it."""
        return np.asarray(self.look_up(np.broadcast_to(True, self.cells.shape), points, False))

    def occupied_at(self, points: ArrayLike) -> Bools:
        """Return for points (..., 2) of `map` [m] whether each is in an occupied cell; beside the map none is."""
        return np.asarray(self.look_up(self.cells, points, FREE) >= SOLID)

    def look_up(self, table: AnyArray, points: ArrayLike, beside: float) -> AnyArray:
        """Return what a table (rows, columns) has for the cells of points (..., 2) of `map` [m]; `beside` the map."""
        found = np.floor(self.to_cells(points))
        with np.errstate(invalid="ignore"):
            inside = np.asarray(((found >= 0) & (found < table.shape[::-1])).all(-1))
        column, row = np.moveaxis(np.where(inside[..., None], found, 0).astype(np.intp), -1, 0)
        return np.where(inside, table[row, column], beside)


def grid_from(
    image: AnyArray,
    resolution: float,
    origin: Pose2,
    *,
    occupied_thresh: float,
    free_thresh: float,
    negate: bool = False,
    mode: str = "trinary",
    white: int = 255,
) -> GridMap:
    """Return the map that map_server makes of an image of whole numbers up to `white`, its upper row first.

    An image is (rows, columns) or (rows, columns, channels), where 2 or 4 channels end with alpha. `trinary` averages
    alpha with the colours, as map_server does; in `scale`, what is not opaque is unknown; `raw` takes the grey for the
    value of the cell.

    Raises:
        MapError: if there is no such map.
    """
    if mode not in MODES:
        raise MapError(f"the mode is one of {', '.join(MODES)}, not '{mode}'")
    if not 0 <= free_thresh <= occupied_thresh <= 1:
        raise MapError(
            f"free_thresh {free_thresh} and occupied_thresh {occupied_thresh} are not in order within 0 to 1"
        )
    if image.ndim not in (2, 3):
        raise MapError(f"an image has 2 or 3 dimensions, not {image.ndim}")
    image = image[::-1]
    alpha = image[..., -1] if image.ndim == 3 and image.shape[2] in (2, 4) else None
    if alpha is not None and mode != "trinary":
        image = image[..., :-1]
    channels = image.shape[2] if image.ndim == 3 else 1
    greys = image if image.ndim == 2 else image.sum(2, np.uint32)
    if greys.size and greys.max() > white * channels:
        raise MapError(f"a pixel is brighter than white, which is {white}")
    shade = np.linspace(0.0, 1.0, white * channels + 1)
    cells = _values(shade, negate, mode, occupied_thresh, free_thresh)[greys]
    if alpha is not None and mode == "scale":
        cells[alpha < white] = UNKNOWN
    return GridMap(cells, resolution, origin)


def _values(shade: Array, negate: bool, mode: str, occupied_thresh: float, free_thresh: float) -> Ints8:
    """Return the value of a cell for each shade, which is 0 for black and 1 for white."""
    if mode == "raw":
        percents = np.floor(shade * 255 + 0.5)
        return np.where(percents <= 100, percents, UNKNOWN).astype(np.int8)
    taken = shade if negate else 1.0 - shade
    between = (taken - free_thresh) / max(occupied_thresh - free_thresh, 1e-9) * 100
    middle = np.rint(np.clip(between, 0, 100)) if mode == "scale" else UNKNOWN
    return np.where(taken > occupied_thresh, OCCUPIED, np.where(taken < free_thresh, FREE, middle)).astype(np.int8)


def read_map(path: Path) -> GridMap:
    """Return the map that a YAML file of map_server describes; its picture is a PGM or PNG file.

    Raises:
        MapError: if it cannot be read, or is not a map.
    """
    try:
        entries = _entries(_read(path, MOST_TEXT).decode(), path.name)
    except UnicodeDecodeError:
        raise MapError(f"{path.name} is not text") from None
    picture = path.parent / _entry(entries, "image")
    need(str(path.parent), _entry(entries, "image"))
    if (negate := YES_OR_NO.get(_entry(entries, "negate").lower())) is None:
        raise MapError("'negate' is 0 or 1")
    origin = entries.get("origin")
    if not isinstance(origin, list) or len(origin) != 3:
        raise MapError("'origin' is a list of three numbers: x, y, yaw")
    resolution = _number("resolution", _entry(entries, "resolution"))
    thresholds = {name: _number(name, _entry(entries, name)) for name in WRITTEN}
    image, white = _image(_read(picture, MOST_BYTES), picture.name)
    return grid_from(
        image,
        resolution,
        Pose2(*(_number("origin", text) for text in origin)),
        negate=negate,
        mode=str(entries.get("mode", "trinary")).lower(),
        white=white,
        **thresholds,
    )


def _read(path: Path, most: int) -> bytes:
    try:
        return read_regular(path, most)
    except (OSError, ValueError) as error:
        raise MapError(f"cannot read {path.name or path}: {getattr(error, 'strerror', None) or error}") from error


def _entries(text: str, name: str) -> dict[str, object]:
    """Return the entries of a YAML mapping as texts and lists of texts; any other value is None."""
    root, trouble = compose(text, name)
    if trouble is not None:
        raise MapError(f"{name} is not YAML: {trouble.message}")
    if not isinstance(root, yaml.MappingNode):
        raise MapError(f"{name} has no entries")
    found: dict[str, object] = {}
    for key, value in root.value:
        if not isinstance(key, yaml.ScalarNode):
            raise MapError(f"{name} has a key that is no name")
        if key.value in found:
            raise MapError(f"'{plain(key.value, 60)}' is written twice in {name}")
        if isinstance(value, yaml.SequenceNode) and all(isinstance(item, yaml.ScalarNode) for item in value.value):
            found[key.value] = [item.value for item in value.value]
        else:
            found[key.value] = value.value if isinstance(value, yaml.ScalarNode) else None
    return found


def _entry(entries: Mapping[str, object], name: str) -> str:
    value = entries.get(name)
    if not isinstance(value, str) or not value:
        raise MapError(f"'{name}' is missing")
    return value


def _number(name: str, text: object) -> float:
    try:
        value = float(str(text))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise MapError(f"'{name}' is a finite number, not '{text}'")
    return value


def _check_size(width: int, height: int) -> None:
    if not 0 < width * height <= MOST_CELLS:
        raise MapError(f"a map has 1 to {MOST_CELLS:,} cells, not {width} x {height}")


def _image(data: bytes, name: str) -> tuple[AnyArray, int]:
    """Return a picture, and the number that is white in it."""
    if data.startswith(b"\x89PNG"):
        return _png(data, name)
    if not data.startswith((b"P2", b"P5")):
        raise MapError(f"{name} is neither PGM (P2 or P5) nor PNG")
    if (header := PGM_HEADER.match(data)) is None:
        raise MapError(f"the header of {name} is not that of a PGM")
    width, height, white = map(int, header.groups()[1:])
    _check_size(width, height)
    if not 0 < white < 1 << 16:
        raise MapError(f"white in {name} is 1 to 65535, not {white}")
    body = data[header.end() :]
    if header[1] == b"5":
        wide = np.dtype(">u2" if white > 255 else np.uint8)
        pixels = np.frombuffer(body, wide, count=len(body) // wide.itemsize)
    else:
        try:
            pixels = np.array(COMMENT.sub(b"", body).split(), np.uint32)
        except (ValueError, OverflowError):
            raise MapError(f"{name} has a pixel that is not a number") from None
    if len(pixels) < width * height:
        raise MapError(f"{name} is truncated: {len(pixels)} of {width} x {height} pixels")
    return pixels[: width * height].reshape(height, width), white


def _png(data: bytes, name: str) -> tuple[AnyArray, int]:
    try:
        from PIL import Image
    except ImportError:
        raise MapError(f"{name} is a PNG, which needs pillow: pip install pillow") from None
    try:
        picture = Image.open(BytesIO(data), formats=("PNG",))
        _check_size(picture.width, picture.height)
        if picture.mode.startswith("I"):
            return np.asarray(picture), 65535
        if picture.mode not in ("L", "LA", "RGB", "RGBA"):
            has_alpha = "transparency" in picture.info
            picture = picture.convert("RGBA" if has_alpha else "RGB")  # type: ignore[assignment]
        return np.asarray(picture), 255
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise MapError(f"{name} cannot be read: {error}") from error


def map_files(grid: GridMap, name: str) -> dict[str, bytes]:
    """Return the files that keep a map, by file name: `NAME.yaml` and `NAME.pgm`. `read_map` returns the same map.

    The mode is `raw` if a cell is something else than free, occupied or unknown.
    """
    is_trinary = bool(np.isin(grid.cells, list(GREYS)).all())
    table = np.full(256, 255, np.uint8)  # by the value as uint8, so that -1 is the last one
    table[:101] = range(101)
    if is_trinary:
        for value, grey in GREYS.items():
            table[value] = grey
    rows, columns = grid.cells.shape
    origin = grid.origin
    entries = {
        "image": f"{name}.pgm",
        "mode": "trinary" if is_trinary else "raw",
        "resolution": float(grid.resolution),
        "origin": [float(origin.x), float(origin.y), float(origin.heading)],
        "negate": 0,
        **WRITTEN,
    }
    text = "".join(f"{key}: {value if key == 'mode' else json.dumps(value)}\n" for key, value in entries.items())
    header = f"P5\n{columns} {rows}\n255\n".encode()
    return {f"{name}.yaml": text.encode(), f"{name}.pgm": header + table[grid.cells[::-1].view(np.uint8)].tobytes()}


def wall_rectangles(grid: GridMap) -> Indices:
    """Return rectangles (n, 4) that cover the occupied cells, and nothing else, without overlap.

    Each is its first column and row, and the first column and row behind it, in cells. Occupied runs of a row are
    merged with equal ones of the next row; the same is done by columns, and the shorter list counts.
    """
    solid = grid.cells >= SOLID
    by_rows, by_columns = _merged_runs(solid), _merged_runs(solid.T)[:, [1, 0, 3, 2]]
    return by_rows if len(by_rows) <= len(by_columns) else by_columns


def _merged_runs(solid: Bools) -> Indices:
    """Return rectangles (n, 4) of equal runs in consecutive rows."""
    change = np.diff(np.pad(solid, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, starts = np.nonzero(change == 1)
    ends = np.nonzero(change == -1)[1]
    order = np.lexsort((rows, ends, starts))
    rows, starts, ends = rows[order], starts[order], ends[order]
    follows = (np.diff(rows) == 1) & (np.diff(starts) == 0) & (np.diff(ends) == 0)
    is_first = np.ones(rows.size, bool)
    is_first[1:] = ~follows
    first = np.flatnonzero(is_first)
    last = np.append(first[1:], rows.size) - 1 if rows.size else first
    return np.stack((starts[first], rows[first], ends[first], rows[last] + 1), -1)
