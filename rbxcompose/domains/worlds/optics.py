"""Cameras as pinholes with distortion, and their messages."""

from __future__ import annotations

import math
from functools import cached_property

from rbxcompose.base.arrays import Array, Bytes, Singles, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.msgs.builtin_interfaces import Time
from rbxcompose.msgs.geometry_msgs import TransformStamped
from rbxcompose.msgs.poses import transform_message
from rbxcompose.msgs.sensor_msgs import CameraInfo, Image, PointCloud2, PointField
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage

MOST_BENT = 3.0  # times as wide as a picture is the one that is bent to it
LEAST_VIEW, MOST_VIEW = 0.01, 3.0  # [rad] from the left to the right edge
ROUNDS = 20  # of the iteration that straightens what a lens has bent
DISTORTIONS = {"": (0, 4, 5), "plumb_bob": (0, 4, 5), "rational_polynomial": (0, 8), "thin_prism": (12, 14)}
"""Models of distortion, and how many coefficients each may have."""

OPTICAL = "optical_frame"
TO_OPTICAL = Transform3((0.0, 0.0, 0.0), (-0.5, 0.5, -0.5, 0.5))
"""From a frame with x ahead and z up to one with z ahead and y down: REP 103."""


def optical_frame(frame: str) -> str:
    """Return the optical frame of a camera: its frame if the name ends so, else one with its name."""
    if frame.endswith(OPTICAL):
        return frame
    return f"{frame.removesuffix('_frame').removesuffix('_link')}_{OPTICAL}"


def optical_link(frame: str, stamp: Time) -> TFMessage:
    """Return where the optical frame of a camera is in its frame."""
    link = TransformStamped(Header(stamp, frame), optical_frame(frame), transform_message(TO_OPTICAL))
    return TFMessage(transforms=(link,))


@dataclass(frozen=True)
class Intrinsics:
    """How a camera maps directions to pixels: a pinhole with distortion by the model of OpenCV.

    In its optical frame z is ahead, x to the right of the picture, and y down. The middle of the first pixel is (0, 0),
    as in `sensor_msgs/CameraInfo`.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()

    @classmethod
    def of_view(cls, width: int, height: int, view: float, distortion: tuple[float, ...] = ()) -> Intrinsics:
        """Return those of a camera with square pixels that sees an angle [rad] from its left to its right edge."""
        focal = width / 2 / math.tan(view / 2)
        return cls(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2, distortion)

    @classmethod
    def of_message(cls, info: CameraInfo) -> Intrinsics:
        """Return what a camera tells about itself.

        Raises:
            ValueError: if it tells nothing that can be used.
        """
        k, d = [float(one) for one in info.k], tuple(float(one) for one in info.d)
        if info.distortion_model not in DISTORTIONS:
            raise ValueError(f"the distortion model '{info.distortion_model[:40]}' is not known")
        if len(d) not in DISTORTIONS[info.distortion_model]:
            raise ValueError(f"{len(d)} coefficients are no distortion of the model '{info.distortion_model}'")
        if not all(map(math.isfinite, (*k, *d))) or k[0] <= 0 or k[4] <= 0:
            raise ValueError("the camera is not calibrated: its camera_info has no focal length")
        return cls(info.width, info.height, k[0], k[4], k[2], k[5], d)

    @property
    def view(self) -> float:
        """Return the angle from the left to the right edge [rad], without distortion."""
        return 2 * math.atan(self.width / 2 / self.fx)

    @property
    def model(self) -> str:
        """Return the model of its distortion."""
        return "plumb_bob" if len(self.distortion) <= 5 else "rational_polynomial"

    @cached_property
    def matrix(self) -> Array:
        """Return them as a matrix (3, 3)."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @cached_property
    def coefficients(self) -> Array:
        """Return the distortion for OpenCV (n,)."""
        return np.array(self.distortion or (0.0,) * 4, float)

    def straight(self, pixels: Array) -> Array:
        """Return x / z and y / z of the directions of pixels (n, 2), by iteration as OpenCV does it."""
        bent = (np.asarray(pixels, float) - (self.cx, self.cy)) / (self.fx, self.fy)
        found = bent
        for _ in range(ROUNDS if any(self.distortion) else 0):
            radial, aside = self._bending(found)
            found = (bent - aside) / radial
        return found

    def _bending(self, straight: Array) -> tuple[Array, Array]:
        """Return by which directions (n, 2) are multiplied (n, 1), and what is then added to them (n, 2)."""
        k1, k2, p1, p2, k3, k4, k5, k6 = (*self.distortion, *(0.0,) * 8)[:8]
        x, y = straight.T
        square = x * x + y * y
        radial = 1 + square * (k1 + square * (k2 + square * k3))
        radial = radial / (1 + square * (k4 + square * (k5 + square * k6)))
        right = 2 * p1 * x * y + p2 * (square + 2 * x * x)
        down = p1 * (square + 2 * y * y) + 2 * p2 * x * y
        return radial[:, None], np.stack((right, down), 1)

    @cached_property
    def rays(self) -> Array:
        """Return the direction of each pixel, with z = 1 (h, w, 3)."""
        across, down = np.meshgrid(np.arange(self.width, dtype=float), np.arange(self.height, dtype=float))
        x, y = self.straight(np.column_stack((across.ravel(), down.ravel()))).T
        return np.stack((x, y, np.ones_like(x)), -1).reshape(self.height, self.width, 3)

    @property
    def is_lens(self) -> bool:
        """Return whether `unbent` can draw it: it can be undone, and is at most three times as wide as a picture."""
        with np.errstate(all="ignore"):
            straight = self.rays[:, :, :2].reshape(-1, 2)
            radial, aside = self._bending(straight)
            pixels = (straight * radial + aside) * (self.fx, self.fy) + (self.cx, self.cy)
            across, down = np.meshgrid(np.arange(self.width), np.arange(self.height))
            off = np.abs(pixels - np.column_stack((across.ravel(), down.ravel()))).max()
            half = np.abs(straight).max(0) * max(self.fx, self.fy)
        return bool(off < 0.1 and (half <= MOST_BENT / 2 * np.array((self.width, self.height))).all())

    @cached_property
    def unbent(self) -> Intrinsics:
        """Return a camera with square pixels, no distortion and its axis in the middle that sees all of this one."""
        middle = (self.width - 1) / 2, (self.height - 1) / 2
        if not any(self.distortion) and self.fx == self.fy and (self.cx, self.cy) == middle:
            return self
        focal = max(self.fx, self.fy)
        half = np.abs(self.rays[:, :, :2]).max((0, 1)) * focal
        width, height = (int(2 * math.ceil(one) + 3) for one in half)
        return Intrinsics(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)


def info_message(header: Header, camera: Intrinsics) -> CameraInfo:
    """Return what a camera tells about itself."""
    projection = np.column_stack((camera.matrix, np.zeros(3)))
    bent = camera.distortion
    return CameraInfo(
        header,
        camera.height,
        camera.width,
        camera.model,
        np.array(bent if len(bent) > 5 else (*bent, *(0.0,) * 5)[:5]),
        camera.matrix.ravel(),
        np.eye(3).ravel(),
        projection.ravel(),
    )


def picture_message(header: Header, colours: Bytes) -> Image:
    """Return colours (h, w, 3) as a message."""
    height, width, _ = colours.shape
    return Image(header, height, width, "rgb8", 0, 3 * width, np.ascontiguousarray(colours).tobytes())


def depth_message(header: Header, depths: Singles) -> Image:
    """Return depths (h, w) [m] as a message, as REP 118 has it."""
    height, width = depths.shape
    return Image(header, height, width, "32FC1", 0, 4 * width, depths.astype("<f4").tobytes())


def cloud_message(header: Header, rays: Array, depths: Singles, colours: Bytes) -> PointCloud2:
    """Return depths [m] along rays (h, w, 3) as a cloud with a point for each pixel; without a depth, it is nan."""
    height, width = depths.shape
    known = np.where(np.isfinite(depths), depths, np.float32(math.nan))
    rows = np.zeros((height, width), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
    for axis, name in enumerate("xyz"):
        rows[name] = rays[:, :, axis] * known
    red, green, blue = (colours[:, :, index].astype(np.uint32) for index in range(3))
    rows["rgb"] = red << 16 | green << 8 | blue
    fields = tuple(
        PointField(name, 4 * index, PointField.FLOAT32, 1) for index, name in enumerate(("x", "y", "z", "rgb"))
    )
    return PointCloud2(header, height, width, fields, False, 16, 16 * width, rows.tobytes(), False)
