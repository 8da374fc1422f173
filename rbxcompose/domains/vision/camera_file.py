"""The calibration of a camera as a file, in the form of ROS's camera_calibration."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import yaml

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.domains.worlds.optics import Intrinsics

LARGEST = 100_000  # [bytes]
MODELS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (8,)}
"""Models of distortion, and how many coefficients each may have."""


class CameraFileError(ValueError):
    """Raised for a file that is no calibration, with the reason."""


@dataclass(frozen=True, slots=True)
class CameraFile:
    """How a camera maps directions to pixels, as it was measured."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    model: str = "plumb_bob"

    @classmethod
    def read(cls, path: Path) -> CameraFile:
        """Return what a file says.

        Raises:
            CameraFileError: if it cannot be read, or is no calibration.
        """
        try:
            read = yaml.safe_load(read_regular(path, LARGEST).decode("utf-8"))
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
        return cls(width, height, matrix[0], matrix[4], matrix[2], matrix[5], tuple(bent), model)

    @property
    def intrinsics(self) -> Intrinsics:
        """Return it as cameras use it."""
        return Intrinsics(self.width, self.height, self.fx, self.fy, self.cx, self.cy, self.distortion)

    @property
    def text(self) -> str:
        """Return it as a file."""
        bent = self.distortion or (0.0,) * 5
        matrix = [self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0]
        projection = [self.fx, 0.0, self.cx, 0.0, 0.0, self.fy, self.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
        return (
            f"image_width: {self.width}\nimage_height: {self.height}\ncamera_name: camera\n"
            f"camera_matrix: {_table(3, 3, matrix)}\n"
            f"distortion_model: {self.model}\ndistortion_coefficients: {_table(1, len(bent), bent)}\n"
            f"rectification_matrix: {_table(3, 3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])}\n"
            f"projection_matrix: {_table(3, 4, projection)}\n"
        )


def _table(rows: int, columns: int, numbers: Any) -> str:
    shown = ", ".join(f"{number:.8g}" for number in numbers)
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
