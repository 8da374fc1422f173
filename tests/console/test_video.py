"""Pictures for browsers: parameters of an address, encodings, sizes."""

from __future__ import annotations

import struct
from io import BytesIO
from typing import Any
from urllib.parse import parse_qsl

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Pictures

from rbxcompose.domains.console.video import LARGEST, Picture, encoded, wanted
from rbxcompose.msgs.sensor_arrays import WrongPictureError, pixels
from rbxcompose.msgs.sensor_msgs import CompressedImage, Image

RED = (200, 30, 10)


def image(encoding: str, data: bytes, width: int = 2, height: int = 1, **more: Any) -> Image:
    fields = {"step": len(data) // height} | more
    return Image(height=height, width=width, encoding=encoding, data=data, **fields)


def opened(data: bytes) -> Pictures.Image:
    return Pictures.open(BytesIO(data))


@pytest.mark.parametrize(
    ("query", "want"),
    [
        ({"topic": "/camera"}, Picture("/camera", "jpeg", 0, 0, 95, is_inverted=False)),
        (
            {"topic": "camera", "type": "png", "width": "320.4", "quality": "9", "invert": ""},
            Picture("/camera", "png", 320, 0, 9, is_inverted=True),
        ),
        ({"topic": "a", "type": "ros_compressed", "quality": "50"}, Picture("/a", "jpeg", 0, 0, 50, is_inverted=False)),
    ],
    ids=["plain", "png", "compressed"],
)
def test_an_address_says_what_is_wanted(query: dict[str, str], want: Picture) -> None:
    assert wanted(query) == want


@pytest.mark.parametrize("last", ["topic=/a", "type=png", "width=8", "height=6", "quality=5", "invert"])
def test_what_pages_append_against_caches_belongs_to_no_parameter(last: str) -> None:
    others = {"topic=/a", "type=png", "width=8", "height=6", "quality=5", "invert"} - {last}
    query = dict(parse_qsl("&".join((*others, f"{last}?killcache=0.83")), keep_blank_values=True))
    assert wanted(query) == Picture("/a", "png", 8, 6, 5, is_inverted=True)


@pytest.mark.parametrize(
    "query",
    [
        {},
        {"topic": "/"},
        {"topic": "a", "type": "h264"},
        {"topic": "a", "width": "x"},
        {"topic": "a", "width": "x?killcache=0.83"},
        {"topic": "a", "width": "1e9"},
        {"topic": "a", "quality": "0"},
    ],
    ids=str,
)
def test_an_address_that_makes_no_sense_is_refused(query: dict[str, str]) -> None:
    with pytest.raises(WrongPictureError):
        wanted(query)


@given(st.dictionaries(st.sampled_from(["topic", "type", "width", "height", "quality", "invert"]), st.text()))
def test_no_address_does_any_harm(query: dict[str, str]) -> None:
    try:
        want = wanted(query)
    except WrongPictureError:
        return
    assert want.topic.startswith("/")


@pytest.mark.parametrize(
    ("encoding", "data"),
    [
        ("rgb8", bytes(RED) * 2),
        ("bgr8", bytes(reversed(RED)) * 2),
        ("rgba8", bytes((*RED, 255)) * 2),
        ("bgra8", bytes((*reversed(RED), 255)) * 2),
    ],
)
def test_colours_are_those_of_the_encoding(encoding: str, data: bytes) -> None:
    assert pixels(image(encoding, data)).tolist() == [[list(RED)] * 2]


def test_rows_may_be_longer_than_their_pixels() -> None:
    assert pixels(image("mono8", bytes((1, 2, 99, 3, 4, 99)), 2, 2)).tolist() == [[1, 2], [3, 4]]


@pytest.mark.parametrize(("kind", "encoding"), [("<u2", "16UC1"), (">u2", "mono16"), ("<f4", "32FC1")])
def test_depths_are_scaled_and_unknown_ones_are_dark(kind: str, encoding: str) -> None:
    data = np.array([1, 3, 0], kind).tobytes()
    shown = pixels(image(encoding, data, 3, is_bigendian=int(kind[0] == ">")))
    assert shown.tolist() == [[0, 255, 0]]


@pytest.mark.parametrize(
    "message",
    [image("yuv", bytes(6)), image("rgb8", bytes(5)), image("rgb8", b"", 0, 1), image("mono8", bytes(2), 3)],
    ids=["encoding", "short", "empty", "narrow"],
)
def test_what_is_no_picture_is_refused(message: Image) -> None:
    with pytest.raises(WrongPictureError):
        pixels(message)


def test_a_picture_has_the_size_that_is_wanted_and_keeps_its_shape() -> None:
    message = image("rgb8", bytes(RED) * 200, 20, 10)
    picture = opened(encoded(message, Picture("/a", "png", 10, 0, 3, is_inverted=False)))
    assert (picture.size, picture.getpixel((5, 2))) == ((10, 5), RED)


def test_a_picture_may_be_turned() -> None:
    message = image("mono8", bytes((10, 200)))
    picture = opened(encoded(message, Picture("/a", "png", 0, 0, 3, is_inverted=True)))
    assert list(picture.tobytes()) == [200, 10]


def test_what_is_compressed_already_is_passed_on() -> None:
    written = BytesIO()
    Pictures.new("RGB", (4, 2), RED).save(written, "JPEG")
    message = CompressedImage(format="rgb8; jpeg compressed bgr8", data=written.getvalue())
    assert encoded(message, Picture("/a", "jpeg", 0, 0, 95, is_inverted=False)) == written.getvalue()
    assert opened(encoded(message, Picture("/a", "jpeg", 2, 0, 95, is_inverted=False))).size == (2, 1)
    with pytest.raises(WrongPictureError):
        encoded(CompressedImage(format="jpeg", data=b"x"), Picture("/a", "png", 0, 0, 3, is_inverted=False))


@pytest.mark.parametrize("form", ["PNG", "JPEG", "ICO"])
def test_few_bytes_are_never_decoded_to_a_huge_picture(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Pictures.Image, "convert", None)
    written = BytesIO()
    Pictures.new("L", (LARGEST, LARGEST + 1)).save(written, "PNG" if form == "ICO" else form)
    data = written.getvalue()
    if form == "ICO":  # which Pillow decodes to open it
        data = struct.pack("<3H4B2H2I", 0, 1, 1, 16, 16, 0, 0, 1, 1, len(data), 22) + data
    with pytest.raises(WrongPictureError, match="no picture" if form == "ICO" else "4096 x 4097 pixels"):
        encoded(CompressedImage(format=form, data=data), Picture("/a", "png", 100, 0, 3, is_inverted=False))


def test_a_picture_is_never_scaled_to_a_huge_one() -> None:
    with pytest.raises(WrongPictureError, match="would have 4096 x 36864000 pixels"):
        encoded(image("mono8", bytes(9000), 1, 9000), Picture("/a", "png", LARGEST, 0, 3, is_inverted=False))
