"""Pictures in messages as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbxcompose.base.arrays import np
from rbxcompose.msgs.sensor_msgs import Image

_CHANNELS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1, "8UC1": 1, "8UC3": 3}
DEPTHS: Mapping[str, str] = {"mono16": "u2", "16UC1": "u2", "32FC1": "f4"}
"""Encodings of pictures whose values are depths, and what a value is."""

Pixels = np.ndarray[Any, np.dtype[np.uint8]]


class WrongPictureError(ValueError):
    """Raised for a message of which no picture can be made, and for a wish that no picture fulfils."""


def pixels(message: Image) -> Pixels:
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


def _scaled(depths: np.ndarray[Any, np.dtype[np.float64]]) -> Pixels:
    is_known = np.isfinite(depths) & (depths > 0)
    if not is_known.any():
        return np.zeros(depths.shape, np.uint8)
    least, most = depths[is_known].min(), depths[is_known].max()
    shown = np.where(is_known, (depths - least) / max(most - least, 1e-9), 0.0)
    return (shown * 255).astype(np.uint8)


def grey(message: Image) -> Pixels:
    """Return a picture as an array of brightness, rows x columns, by the weights of ITU-R BT.601.

    Raises:
        WrongPictureError: if its size and its data do not fit, or its encoding is not known.
    """
    found = pixels(message)
    if found.ndim == 2:
        return np.ascontiguousarray(found)
    weighted = found[:, :, 0] * np.uint32(77) + found[:, :, 1] * np.uint32(150) + found[:, :, 2] * np.uint32(29)
    return np.asarray(weighted >> 8, np.uint8)
