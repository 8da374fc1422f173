"""How a camera maps directions to pixels, measured by pictures of a flat board, and as a file.

As Z. Zhang, A Flexible New Technique for Camera Calibration (2000), by OpenCV; its uncertainties are those of a fit to
corners that are as far off as those of this one are. Files are in the form of ROS's camera_calibration.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from rbxcompose.base.arrays import Array, Bytes, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.domains.worlds.optics import LEAST_VIEW, MOST_VIEW, Intrinsics

LARGEST, LARGEST_FILE = 100_000_000, 100_000  # [bytes] of a picture, and of a calibration
MODELS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (8,)}
"""Models of distortion, and how many coefficients each may have."""
LEAST_VIEWS, LEAST_CORNERS = 8, 12
SAME = 0.03  # of the diagonal of a picture, by which corners have moved at least in a new view
TILTED = math.radians(12)  # between the normals of two views at least: views from one side do not tell the focal length
COVERED = 0.55  # of the width and of the height of the picture, which all corners together span at least
FAR_OFF = 3.0  # times as far off as usual: a view that does not fit


class CalibrationError(ValueError):
    """Raised when pictures do not tell how a camera maps directions to pixels, with the reason and a cure."""


class Chessboard:
    """A chessboard with so many inner corners along its rows and its columns."""

    def __init__(self, columns: int, rows: int, square: float) -> None:
        """Take the side of a square [m]."""
        self.columns, self.rows, self.square = columns, rows, square

    def corners(self, picture: Bytes) -> tuple[Array, Array]:
        """Return places of corners on the board (n, 2) [m] and in a picture in grey (n, 2) [px], if all are seen."""
        import cv2

        flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY
        found, points = cv2.findChessboardCornersSB(picture, (self.columns, self.rows), flags=flags)
        if not found:
            return np.empty((0, 2)), np.empty((0, 2))
        grid = np.array([(x, y) for y in range(self.rows) for x in range(self.columns)], float) * self.square
        return grid, np.asarray(points, float).reshape(-1, 2)


class TagSheet:
    """Tags of known places on a sheet; some may be hidden."""

    def __init__(self, family: str, size: float, places: Mapping[int, tuple[float, float]]) -> None:
        """Take the side of a black square, and where its upper left corner is on the sheet [m] (x right, y down)."""
        from rbxcompose.domains.vision.tags import TagFinder

        self.size, self.places, self._finder = size, places, TagFinder(family)

    def corners(self, picture: Bytes) -> tuple[Array, Array]:
        """Return the same of the tags that are seen."""
        on_board, on_picture = [], []
        square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float) * self.size
        for tag in self._finder.find(picture):
            if tag.number in self.places:
                on_board.append(square + self.places[tag.number])
                on_picture.append(tag.corners)
        if not on_board:
            return np.empty((0, 2)), np.empty((0, 2))
        return np.concatenate(on_board), np.concatenate(on_picture)


CalibrationBoard = Chessboard | TagSheet
"""A flat board with corners that can be told apart."""


@dataclass(frozen=True, eq=False)
class BoardView:
    """A board in a picture."""

    board: Array
    """Corners on the board (n, 2) [m]."""
    picture: Array
    """The same in the picture (n, 2) [px]."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """What was measured."""

    camera: Intrinsics
    miss: float
    """How far corners are from where they should be, root mean square [px]."""
    known_to: tuple[float, float]
    """Standard deviations of the focal length and of the axis [px]."""
    misses: tuple[float, ...]
    """Of each view [px]."""

    @property
    def doubtful(self) -> list[int]:
        """Return the views that fit much worse than others, from 0 on."""
        usual = float(np.median(self.misses))
        return [number for number, miss in enumerate(self.misses) if miss > FAR_OFF * max(usual, 0.1)]


class CalibrationViews:
    """Views of one camera, each unlike those before."""

    def __init__(self, board: CalibrationBoard) -> None:
        self.board = board
        self.views: list[BoardView] = []
        self.size: tuple[int, int] | None = None
        """Width and height of the pictures."""

    def take(self, picture: Bytes) -> str:
        """Take a picture (h, w); return why it is left out, or nothing."""
        size = picture.shape[1], picture.shape[0]
        if self.size is not None and size != self.size:
            return f"it has {size[0]} x {size[1]} pixels, and those before have {self.size[0]} x {self.size[1]}"
        board, corners = self.board.corners(picture)
        if len(board) < LEAST_CORNERS:
            return "the board is not seen" if not len(board) else f"only {len(board)} corners of the board are seen"
        if any(_alike(view, board, corners, math.hypot(*size)) for view in self.views):
            return "it looks like one before"
        self.size = size
        self.views.append(BoardView(board, corners))
        return ""

    @property
    def spans(self) -> tuple[float, float]:
        """Return which parts of the width and of the height of the picture the corners span."""
        if self.size is None:
            return 0.0, 0.0
        corners = np.concatenate([view.picture for view in self.views])
        across, down = (np.ptp(corners, axis=0) / self.size).tolist()
        return across, down

    def calibrated(self) -> Calibrated:
        """Return what the views tell.

        Raises:
            CalibrationError: if they are too few or too much alike.
        """
        import cv2

        if len(self.views) < LEAST_VIEWS or self.size is None:
            raise CalibrationError(
                f"{len(self.views)} views of the board are too few: it takes {LEAST_VIEWS}, better 15"
            )
        across, down = self.spans
        if min(across, down) < COVERED:
            raise CalibrationError(
                f"the board was seen in {across:.0%} of the width and {down:.0%} of the height of the picture: "
                f"hold it into all corners, for {COVERED:.0%} at least"
            )
        boards = [np.column_stack((view.board, np.zeros(len(view.board)))).astype(np.float32) for view in self.views]
        pictures = [view.picture.astype(np.float32).reshape(-1, 1, 2) for view in self.views]
        miss, matrix, bent, turns, _, spread, _, misses = cv2.calibrateCameraExtended(
            boards, pictures, self.size, np.eye(3), np.zeros(5)
        )
        normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
        tilt = math.acos(min(1.0, float(np.clip(normals @ normals.T, -1, 1).min())))
        if tilt < TILTED:
            raise CalibrationError(
                f"the board was tilted by {math.degrees(tilt):.0f} deg at most: tilt it to all sides, by 30 deg or so"
            )
        fx, fy, cx, cy = (float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
        if not all(map(math.isfinite, (fx, fy, cx, cy, miss))) or min(fx, fy) <= 0:
            raise CalibrationError("no camera explains these views: is the size of the board right?")
        off = np.ravel(spread).tolist()
        camera = Intrinsics(*self.size, fx, fy, cx, cy, tuple(np.ravel(bent).tolist()[:5]))
        known_to = max(off[0], off[1]), max(off[2], off[3])
        return Calibrated(camera, float(miss), known_to, tuple(float(one) for one in np.ravel(misses)))


def _alike(view: BoardView, board: Array, corners: Array, diagonal: float) -> bool:
    """Return whether the corners that two views have in common are at nearly the same places."""
    known = {tuple(place): seen for place, seen in zip(view.board.tolist(), view.picture, strict=True)}
    pairs = ((known.get(tuple(place)), seen) for place, seen in zip(board.tolist(), corners, strict=True))
    moved = [math.dist(seen, before) for before, seen in pairs if before is not None]
    return bool(moved) and max(moved) < SAME * diagonal


def picture_files(paths: Sequence[Any]) -> list[tuple[str, Bytes | str]]:
    """Return files with their pictures in grey, or with the reason why there is none."""
    import cv2

    found: list[tuple[str, Bytes | str]] = []
    for path in paths:
        try:
            data = np.frombuffer(read_regular(path, LARGEST), np.uint8)
            picture = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) if len(data) else None
        except cv2.error:
            picture = None
        except OSError as error:
            found.append((str(path), f"it cannot be read: {error.strerror or error}"))
            continue
        found.append((str(path), "it is no picture" if picture is None else np.asarray(picture, np.uint8)))
    return found


class CameraFileError(ValueError):
    """Raised for a file that is no calibration, with the reason."""


def read_calibration(path: Path) -> Intrinsics:
    """Return what a file says.

    Raises:
        CameraFileError: if it cannot be read, or is no calibration.
    """
    try:
        read = yaml.safe_load(read_regular(path, LARGEST_FILE).decode("utf-8"))
    except OSError as error:
        raise CameraFileError(f"it cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise CameraFileError("it is no YAML") from error
    if not isinstance(read, dict):
        raise CameraFileError("it is no calibration of a camera: it has no keys")
    width, height = (_whole(read, key) for key in ("image_width", "image_height"))
    matrix = _numbers(read, "camera_matrix", (9,))
    model = read.get("distortion_model", "plumb_bob")
    if model not in MODELS:
        raise CameraFileError(f"its 'distortion_model' is not one of {', '.join(MODELS)}")
    bent = _numbers(read, "distortion_coefficients", MODELS[model]) if "distortion_coefficients" in read else []
    if min(matrix[0], matrix[4]) <= 0:
        raise CameraFileError("its 'camera_matrix' has no focal length")
    camera = Intrinsics(width, height, matrix[0], matrix[4], matrix[2], matrix[5], tuple(bent))
    if not LEAST_VIEW < camera.view < MOST_VIEW:
        view = f"{math.degrees(camera.view):.4g} deg"
        raise CameraFileError(f"its 'camera_matrix' is that of a view of {view}: is it in pixels?")
    return camera


def calibration_text(camera: Intrinsics) -> str:
    """Return a calibration as a file."""
    bent, projection = camera.distortion or (0.0,) * 5, np.column_stack((camera.matrix, np.zeros(3)))
    return (
        f"image_width: {camera.width}\nimage_height: {camera.height}\ncamera_name: camera\n"
        f"camera_matrix: {_table(3, 3, camera.matrix)}\n"
        f"distortion_model: {camera.model}\ndistortion_coefficients: {_table(1, len(bent), bent)}\n"
        f"rectification_matrix: {_table(3, 3, np.eye(3))}\n"
        f"projection_matrix: {_table(3, 4, projection)}\n"
    )


def _table(rows: int, columns: int, numbers: Any) -> str:
    shown = ", ".join(f"{number:.8g}" for number in np.ravel(numbers))
    return f"{{rows: {rows}, cols: {columns}, data: [{shown}]}}"


def _whole(read: dict[str, Any], key: str) -> int:
    number = read.get(key)
    if isinstance(number, bool) or not isinstance(number, int) or not 0 < number <= 1 << 16:
        raise CameraFileError(f"its '{key}' is no number of pixels")
    return number


def _numbers(read: dict[str, Any], key: str, counts: tuple[int, ...]) -> list[float]:
    table = read.get(key)
    data = table.get("data") if isinstance(table, dict) else None
    if not isinstance(data, list) or len(data) not in counts:
        raise CameraFileError(f"its '{key}' has no 'data' of {' or '.join(map(str, counts))} numbers")
    if not all(isinstance(one, int | float) and not isinstance(one, bool) and math.isfinite(one) for one in data):
        raise CameraFileError(f"its '{key}' has 'data' that are no numbers")
    return [float(one) for one in data]
