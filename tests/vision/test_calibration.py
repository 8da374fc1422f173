"""A camera is calibrated by pictures of boards, drawn for a camera that is known; and its file says the same."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbxcompose.base.geometry import Transform3, multiply, quaternion_about
from rbxcompose.commands.main import main
from rbxcompose.domains.vision.calibration import (
    CalibrationError,
    CalibrationViews,
    CameraFileError,
    Chessboard,
    TagSheet,
    calibration_text,
    read_calibration,
)
from rbxcompose.domains.vision.commands.tags import MARGIN, PAPERS, tag_places
from rbxcompose.domains.worlds.optics import Intrinsics
from rbxcompose.domains.worlds.physics.solids import rotation_matrix
from rbxcompose.domains.worlds.tag_pictures import DEFAULT_FAMILY, tag_picture, with_margin
from tests.soak import rare

cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed")
TRUTH = Intrinsics(640, 480, 560.0, 562.0, 325.0, 236.0, (-0.22, 0.08, 0.001, -0.0005, 0.0))
FINE = 4000  # pixels of a board in a metre
SQUARE = 0.025
SIZE, TAGS = 0.03, range(30)


@cache
def chessboard() -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return a board of 9 x 7 squares with a white edge."""
    rows, columns = np.indices((7, 9))
    cells = (((rows + columns) % 2) * 255).astype(np.uint8)
    board = np.kron(cells, np.ones((round(SQUARE * FINE),) * 2, np.uint8))
    return np.asarray(np.pad(board, round(SQUARE * FINE), constant_values=255), np.uint8)


def tag_page() -> np.ndarray[Any, np.dtype[np.uint8]]:
    page = np.full([round(side * FINE) for side in reversed(PAPERS["a4"])], 255, np.uint8)
    wide = round(with_margin(SIZE, DEFAULT_FAMILY) * FINE)
    for number, (left, top) in tag_places([*TAGS], DEFAULT_FAMILY, SIZE, "a4")[0].items():
        tag = cv2.resize(tag_picture(number), (wide, wide), interpolation=cv2.INTER_NEAREST)
        page[round(top * FINE) : round(top * FINE) + wide, round(left * FINE) : round(left * FINE) + wide] = tag
    return page


def tag_sheet() -> TagSheet:
    edge = (with_margin(SIZE, DEFAULT_FAMILY) - SIZE) / 2
    places = tag_places([*TAGS], DEFAULT_FAMILY, SIZE, "a4")[0]
    return TagSheet(DEFAULT_FAMILY, SIZE, {number: (x + edge, y + edge) for number, (x, y) in places.items()})


@cache
def rays() -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the directions of all pixels."""
    return TRUTH.rays


@cache
def noise() -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.random.default_rng(1).normal(0, 1.5, (TRUTH.height, TRUTH.width))


def shot(board: np.ndarray[Any, np.dtype[np.uint8]], pose: Transform3) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return what the camera sees of a board at a pose of its middle: each ray meets the plane of the board."""
    turn = rotation_matrix(pose.rotation)
    away = turn[:, 2] @ np.array(pose.translation)
    reach = away / (rays() @ turn[:, 2])
    on_board = (rays() * reach[..., None] - pose.translation) @ turn
    height, width = board.shape
    x, y = ((on_board[..., axis] * FINE + side / 2).astype(np.float32) for axis, side in enumerate((width, height)))
    blurred = cv2.GaussianBlur(board, (0, 0), FINE * pose.translation[2] / TRUTH.fx / 2.5)
    edge = {"borderMode": cv2.BORDER_CONSTANT, "borderValue": 128}
    seen: np.ndarray[Any, Any] = cv2.remap(blurred, x, y, cv2.INTER_LINEAR, **edge)
    return np.asarray(np.clip(seen + noise(), 0, 255), np.uint8)


def poses(distance: float) -> list[Transform3]:
    """Return poses in all parts of the picture, tilted to all sides."""
    found = []
    for number in range(15):
        about = number * 2.4
        tilt = quaternion_about((math.cos(about), math.sin(about), 0.0), math.radians(12 + 2 * (number % 12)))
        roll = quaternion_about((0.0, 0.0, 1.0), 0.1 * number)
        away = distance * (1 + 0.1 * (number % 4))
        aside = 0.3 * away * math.cos(about * 1.7), 0.2 * away * math.sin(about * 1.7)
        found.append(Transform3((aside[0], aside[1], away), multiply(tilt, roll)))
    return found


@pytest.mark.parametrize("kind", ["tags", *rare("chessboard")])
def test_a_camera_is_what_its_pictures_of_a_board_say(kind: str) -> None:
    board, picture, distance = (
        (Chessboard(8, 6, SQUARE), chessboard(), 0.45) if kind == "chessboard" else (tag_sheet(), tag_page(), 0.5)
    )
    views = CalibrationViews(board)
    left_out = [why for pose in poses(distance) if (why := views.take(shot(picture, pose)))]
    assert len(left_out) <= 4
    found = views.calibrated()
    camera = found.camera
    # Corners of small tags seem to be nearer to each other than they are: a chessboard is better.
    assert (camera.fx, camera.fy) == pytest.approx((TRUTH.fx, TRUTH.fy), rel=0.005 if kind == "chessboard" else 0.01)
    assert (camera.cx, camera.cy) == pytest.approx((TRUTH.cx, TRUTH.cy), abs=2.0)
    assert camera.distortion[0] == pytest.approx(TRUTH.distortion[0], abs=0.03)
    assert found.miss < (0.3 if kind == "chessboard" else 0.6)
    assert found.doubtful == []


def test_pictures_that_tell_nothing_are_left_out_with_the_reason() -> None:
    views, page = CalibrationViews(Chessboard(8, 6, SQUARE)), chessboard()
    pose = poses(0.45)[0]
    assert views.take(np.full((480, 640), 128, np.uint8)) == "the board is not seen"
    assert views.take(shot(page, pose)) == ""
    assert views.take(shot(page, pose)) == "it looks like one before"
    assert views.take(np.zeros((240, 320), np.uint8)) == "it has 320 x 240 pixels, and those before have 640 x 480"
    blurred = cv2.GaussianBlur(shot(page, poses(0.45)[3]), (0, 0), 15)
    assert views.take(blurred) == "the board is not seen"
    with pytest.raises(CalibrationError, match="1 views of the board are too few"):
        views.calibrated()


def test_views_of_one_place_or_one_side_are_not_enough() -> None:
    page = tag_page()  # whose corners are found much sooner than those of a chessboard
    small = CalibrationViews(tag_sheet())
    for number in range(8):
        tilt = quaternion_about((math.cos(2.4 * number), math.sin(2.4 * number), 0.0), 0.5)
        roll = quaternion_about((0.0, 0.0, 1.0), 0.25 * number)
        small.take(shot(page, Transform3((0.0, 0.0, 0.9), multiply(tilt, roll))))
    with pytest.raises(CalibrationError, match="hold it into all corners"):
        small.calibrated()
    flat = CalibrationViews(tag_sheet())
    for number in range(8):
        flat.take(shot(page, Transform3((0.12 * math.cos(number), 0.08 * math.sin(number), 0.45 + 0.01 * number))))
    with pytest.raises(CalibrationError, match="tilt it to all sides"):
        flat.calibrated()


def test_a_file_that_is_not_there_is_no_wrong_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "text.png").write_text("no picture")
    files = [str(tmp_path / name) for name in ("text.png", "nofile.png")]
    assert main(["camera", "calibrate", *files, "--chessboard", "8x6", "--square", "25mm"]) == 1
    said = capsys.readouterr().err
    assert "text.png is left out: it is no picture\n" in said
    assert "nofile.png is left out: it cannot be read: No such file or directory\n" in said


@pytest.mark.soak
def test_the_command_writes_a_file_that_cameras_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = chessboard()
    for number, pose in enumerate(poses(0.45)):
        cv2.imwrite(str(tmp_path / f"{number:02}.png"), shot(page, pose))
    (tmp_path / "text.png").write_text("no picture")
    out = tmp_path / "front.yaml"
    pictures = [str(path) for path in sorted(tmp_path.glob("*.png"))]
    assert main(["camera", "calibrate", *pictures, "--chessboard", "8x6", "--square", "25mm", "-o", str(out)]) == 0
    said = capsys.readouterr()
    assert "text.png is left out: it is no picture" in said.err
    assert "corners are off by 0." in said.out
    read = read_calibration(out)
    assert (read.width, read.height) == (640, 480)
    assert read.fx == pytest.approx(TRUTH.fx, rel=0.005)
    assert calibration_text(read_calibration(out)) == out.read_text()


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["a.png"], 2, "give one board"),
        (["a.png", "--chessboard", "8x6"], 2, "a chessboard needs --square"),
        (["a.png", "--tags", "0-400", "--size", "10cm"], 2, "a board is one page"),
        (["nowhere.png", "--chessboard", "8x6", "--square", "25mm"], 1, "0 views of the board are too few"),
    ],
)
def test_what_cannot_be_measured_is_told(
    words: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["camera", "calibrate", *words]) == code
    assert said in capsys.readouterr().err


GOOD = Intrinsics(640, 480, 500.0, 501.0, 320.0, 240.0, (0.1, -0.2, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("image_width: 640", "image_width: wide", "its 'image_width' is no number of pixels"),
        ("data: [500, ", "data: [", "its 'camera_matrix' has no 'data' of 9 numbers"),
        ("data: [500, ", "data: [.nan, ", "its 'camera_matrix' has 'data' that are no numbers"),
        ("data: [500, ", "data: [5, ", "is that of a view of 178.2 deg: is it in pixels?"),
        ("data: [500, ", "data: [-500, ", "its 'camera_matrix' has no focal length"),
        ("plumb_bob", "fisheye", "its 'distortion_model' is not one of"),
        ("image_width: 640", "image_width: [", "it is no YAML"),
    ],
)
def test_a_file_that_is_no_calibration_says_why(tmp_path: Path, old: str, new: str, why: str) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(calibration_text(GOOD))
    assert read_calibration(path) == GOOD
    path.write_text(calibration_text(GOOD).replace(old, new, 1))
    with pytest.raises(CameraFileError, match=why):
        read_calibration(path)
    with pytest.raises(CameraFileError, match="cannot be read"):
        read_calibration(tmp_path / "nowhere.yaml")


def test_margins_of_pages_are_as_printed() -> None:
    assert tag_places([0], DEFAULT_FAMILY, SIZE, "a4")[0][0] == (MARGIN, MARGIN)
