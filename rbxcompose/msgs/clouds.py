"""Clouds of points in messages as arrays."""

from __future__ import annotations

from rbxcompose.base.arrays import Array, np
from rbxcompose.msgs.sensor_msgs import PointCloud2, PointField

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
