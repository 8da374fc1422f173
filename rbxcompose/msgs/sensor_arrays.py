"""Pictures, clouds of points and scans in messages as arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rbxcompose.base.arrays import Array, Bytes, np
from rbxcompose.base.geometry import Pose2, Quaternion, Transform3, yaw_of
from rbxcompose.msgs.sensor_msgs import Image, LaserScan, PointCloud2, PointField

_CHANNELS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1, "8UC1": 1, "8UC3": 3}
DEPTHS: Mapping[str, str] = {"mono16": "u2", "16UC1": "u2", "32FC1": "f4"}
"""Encodings of pictures whose values are depths, and what a value is."""
LEVEL = 1e-6  # sine of half a tilt that is none


class WrongPictureError(ValueError):
    """Raised for a message of which no picture can be made, and for a wish that no picture fulfils."""


def pixels(message: Image) -> Bytes:
    """Return a picture as an array, rows x columns (x 3, RGB). Depths are scaled: the nearest is dark.

    Raises:
        WrongPictureError: if its size and its data do not fit, or its encoding is not known.
    """
    height, width, step = message.height, message.width, message.step
    depth, channels = DEPTHS.get(message.encoding), _CHANNELS.get(message.encoding)
    if channels is None and depth is None:
        known = ", ".join((*_CHANNELS, *DEPTHS))
        raise WrongPictureError(f"the encoding '{message.encoding[:40]}' is not known; there are {known}")
    item = np.dtype(depth or "u1").itemsize * (channels or 1)
    data = np.frombuffer(bytes(message.data), np.uint8)
    if not (height > 0 and width > 0 and width * item <= step and step * height <= data.size):
        raise WrongPictureError(f"{data.size} bytes are no picture of {width} x {height} with rows of {step} bytes")
    rows = data[: step * height].reshape(height, step)[:, : width * item]
    if depth is not None:
        order = ">" if message.is_bigendian else "<"
        return _scaled(np.ascontiguousarray(rows).view(f"{order}{depth}").astype(np.float64))
    if channels is None or channels == 1:
        return rows
    found = rows.reshape(height, width, channels)[:, :, :3]
    return np.ascontiguousarray(found[:, :, ::-1] if message.encoding.startswith("bgr") else found)


def _scaled(depths: Array) -> Bytes:
    is_known = np.isfinite(depths) & (depths > 0)
    if not is_known.any():
        return np.zeros(depths.shape, np.uint8)
    least, most = depths[is_known].min(), depths[is_known].max()
    shown = np.where(is_known, (depths - least) / max(most - least, 1e-9), 0.0)
    return (shown * 255).astype(np.uint8)


def grey(message: Image) -> Bytes:
    """Return a picture as an array of brightness, rows x columns, by the weights of ITU-R BT.601.

    Raises:
        WrongPictureError: if its size and its data do not fit, or its encoding is not known.
    """
    found = pixels(message)
    if found.ndim == 2:
        return np.ascontiguousarray(found)
    weighted = found[:, :, 0] * np.uint32(77) + found[:, :, 1] * np.uint32(150) + found[:, :, 2] * np.uint32(29)
    return np.asarray(weighted >> 8, np.uint8)


MOST_POINTS = 10_000_000
_NUMBERS = {
    PointField.INT8: "i1",
    PointField.UINT8: "u1",
    PointField.INT16: "i2",
    PointField.UINT16: "u2",
    PointField.INT32: "i4",
    PointField.UINT32: "u4",
    PointField.FLOAT32: "f4",
    PointField.FLOAT64: "f8",
}
_AXES = ("x", "y", "z")


class CloudError(ValueError):
    """Raised for a message that is no cloud, with the reason."""


def points_of(message: PointCloud2) -> Array:
    """Return the points of a cloud [m], of shape (n, 3), in the frame of its header; those that are not finite are left
    out, which is how sensors mark that they see nothing.

    Raises:
        CloudError: if the message does not say where x, y and z are, or has fewer bytes than it says.
    """
    points = rows_of(message).reshape(-1, 3)
    return np.asarray(points[np.isfinite(points).all(axis=1)])


def rows_of(message: PointCloud2) -> Array:
    """Return the points of a cloud row by row [m], of shape (height, width, 3), in the frame of its header.

    Raises:
        CloudError: if the message does not say where x, y and z are, or has fewer bytes than it says.
    """
    width, height, step = message.width, message.height, message.point_step
    if width * height > MOST_POINTS:
        raise CloudError(f"it has {width * height:,} points, and may have {MOST_POINTS:,}")
    kind = _layout(message)
    row = message.row_step if height > 1 else width * step
    if row < width * step:
        raise CloudError(f"a row has {row} bytes, and {width} points of {step} bytes")
    needed = (height - 1) * row + width * step if width and height else 0
    if len(message.data) < needed:
        raise CloudError(f"it has {len(message.data):,} bytes, and needs {needed:,}")
    if not needed:
        return np.empty((0, 0, 3))
    raw = np.ndarray((height, width), kind, message.data, strides=(row, step))
    return np.stack([raw[axis] for axis in _AXES], axis=-1).astype(np.float64, copy=False)


def _layout(message: PointCloud2) -> np.dtype[np.void]:
    """Return where x, y and z are within a point."""
    order, fields = ">" if message.is_bigendian else "<", {one.name: one for one in message.fields}
    formats = []
    for axis in _AXES:
        if axis not in fields:
            there = ", ".join(fields) or "none"
            raise CloudError(f"it has no field '{axis}'; its fields: {there}")
        field = fields[axis]
        number = _NUMBERS.get(field.datatype)
        if number is None or field.count > 1:
            raise CloudError(f"its field '{axis}' is no single number")
        if field.offset + int(number[1:]) > message.point_step:
            raise CloudError(f"its field '{axis}' is beyond the {message.point_step} bytes of a point")
        formats.append(order + number)
    offsets = [fields[axis].offset for axis in _AXES]
    return np.dtype({"names": _AXES, "formats": formats, "offsets": offsets, "itemsize": message.point_step})


def rays_of(scan: LaserScan) -> tuple[Array, Array]:
    """Return the angles [rad] and the ranges [m] of a scan as it has them: they may be no numbers."""
    ranges = np.asarray(scan.ranges, np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges), dtype=np.float64)
    return angles, ranges


def level_rays(at: Transform3, scan: LaserScan) -> tuple[Pose2, Array, Array]:
    """Return a scan as seen from above: the pose of its sensor, and the angles [rad] and ranges [m] of its rays there.

    `at` is the pose of the sensor. One that is mounted upside-down turns the other way; of one that is tilted, what is
    level of each ray counts.
    """
    angles, ranges = rays_of(scan)
    turned, shares = seen_from_above(at.rotation, angles)
    with np.errstate(invalid="ignore"):  # inf of a ray that goes straight up
        return at.to_pose2(), turned, ranges * shares


def seen_from_above(rotation: Quaternion, angles: Array) -> tuple[Array, Array]:
    """Return the angles [rad] of rays on the ground, counted from the heading of their sensor, and their level shares.

    `angles` are those around the z axis of a sensor with a rotation. The first of the rays stays next to the second.
    """
    x, y, z, w = rotation
    tilt = math.hypot(x, y)  # sine of half the angle between the axis of the sensor and the vertical
    side = 1.0 if tilt < math.sqrt(0.5) else -1.0
    if min(tilt, math.hypot(z, w)) < LEVEL:
        return side * angles, np.ones(len(angles))
    with np.errstate(invalid="ignore"):
        cos, sin = np.cos(angles), np.sin(angles)
        along = (1 - 2 * (y * y + z * z)) * cos + 2 * (x * y - z * w) * sin
        across = 2 * (x * y + z * w) * cos + (1 - 2 * (x * x + z * z)) * sin
        off = np.arctan2(across, along) - yaw_of(rotation) - side * angles
        return side * angles + np.remainder(off + math.pi, math.tau) - math.pi, np.hypot(along, across)
