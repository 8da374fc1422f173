"""Frames in pieces, in pictures and in CBOR."""

from __future__ import annotations

import json
import math
import struct
import zlib
from base64 import b64encode
from io import BytesIO
from typing import Any

import cbor2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Picture

from rbxcompose.domains.console.encodings import Pieces, WrongEncodingError, as_png, from_png, pieces
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.std_msgs import Float32, String
from tests.console.clients import STAMP, Room

LARGEST = 100_000


@given(st.text(min_size=1), st.integers(1, 50), st.randoms())
def test_pieces_make_the_frame_again_in_any_order(frame: str, size: int, random: Any) -> None:
    made = [json.loads(piece) for piece in pieces(frame, size, "f")]
    random.shuffle(made)
    heap = Pieces(LARGEST)
    joined = [heap.add(piece) for piece in made]
    assert joined == [None] * (len(made) - 1) + [frame]
    assert all(piece["id"] and isinstance(piece["total"], int) for piece in made)


@pytest.mark.parametrize(
    "piece",
    [
        {},
        {"num": 0, "total": 10**9, "data": ""},
        {"num": 2, "total": 2, "data": ""},
        {"num": "0", "total": 1, "data": ""},
    ],
    ids=["empty", "endless", "beyond", "text"],
)
def test_what_is_no_piece_is_refused(piece: dict[str, Any]) -> None:
    with pytest.raises(WrongEncodingError):
        Pieces(LARGEST).add(piece)


def test_pieces_are_kept_within_bounds() -> None:
    heap = Pieces(LARGEST)
    for turn in range(1000):
        assert heap.add({"id": str(turn), "num": 0, "total": 2, "data": "x" * 100}) is None
    with pytest.raises(WrongEncodingError):
        heap.add({"id": "big", "num": 0, "total": 2, "data": "x" * (LARGEST + 1)})


@given(st.text().map(json.dumps))
def test_a_picture_holds_its_frame(frame: str) -> None:
    assert from_png(json.loads(as_png(frame))["data"], LARGEST) == frame.rstrip("\n")


@given(st.text() | st.integers() | st.none())
def test_what_is_no_picture_is_refused(data: object) -> None:
    with pytest.raises(WrongEncodingError):
        from_png(data, LARGEST)


def test_a_picture_that_would_be_huge_is_refused_before_it_is_read() -> None:
    written = BytesIO()
    Picture.new("1", (8, 8)).save(written, "PNG")
    small = written.getvalue()
    head = b"IHDR" + struct.pack(">II", 4_000, 4_000) + small[24:29]
    huge = small[:12] + head + struct.pack(">I", zlib.crc32(head)) + small[33:]
    with pytest.raises(WrongEncodingError, match="a frame has at most"):
        from_png(b64encode(huge).decode(), LARGEST)


def test_a_frame_may_come_in_pieces_or_in_a_picture() -> None:
    room = Room()
    client = room.client()
    frame = json.dumps({"op": "call_service", "service": "/rosapi/topic_type", "args": ["/level"]})
    for piece in pieces(frame, 20, "f"):
        client.sends(piece)
    client.sends(as_png(frame))
    assert [answer["values"]["type"] for answer in client.gets()] == ["std_msgs/msg/Float32"] * 2
    (status,) = client.does("png", data=json.loads(as_png(as_png("{}")))["data"])
    assert "is a frame itself" in status["msg"]


def test_only_who_asks_gets_pieces() -> None:
    room = Room()
    client, other = room.client(), room.client()
    room.graph.known["/text"] = String.TYPE
    client.does("subscribe", topic="/text", fragment_size=300)
    other.does("subscribe", topic="/text")
    room.arrives("/text", String(data="x" * 1000))
    (whole,) = other.gets()
    heap = Pieces(LARGEST)
    joined = [heap.add(piece) for piece in client.gets()]
    assert len(joined) == 4
    assert json.loads(joined[-1] or "") == whole
    assert len(client.does("call_service", service="/rosapi/topics_and_raw_types")) == 1
    assert len(client.does("call_service", service="/rosapi/topics_and_raw_types", fragment_size=300)) > 1
    client.does("unsubscribe", topic="/text")
    client.does("subscribe", topic="/text")
    room.arrives("/text", String(data="x" * 1000))
    assert client.gets() == [whole]


def next_bytes(room: Room, number: int) -> Any:
    frame = room.bridge.next_frame(number, room.now)
    assert isinstance(frame, bytes)
    return cbor2.loads(frame)


def test_cbor_has_typed_arrays_and_every_number() -> None:
    room = Room()
    client = room.client()
    room.graph.known["/scan"] = LaserScan.TYPE
    client.does("subscribe", topic="/scan", compression="cbor")
    room.arrives("/scan", LaserScan(range_max=math.inf, ranges=np.array([1, math.nan], np.float32)))
    frame = next_bytes(room, client.number)
    assert (frame["op"], frame["topic"], frame["msg"]["range_max"]) == ("publish", "/scan", math.inf)
    ranges = frame["msg"]["ranges"]
    values = ranges if not isinstance(ranges, cbor2.CBORTag) else np.frombuffer(ranges.value, "<f4").tolist()
    assert values[0] == 1
    assert math.isnan(values[1])


def test_raw_cbor_is_the_message_as_on_the_bus() -> None:
    room = Room()
    client = room.client()
    client.does("subscribe", topic="/odom", compression="cbor-raw")
    room.bridge.arrived("/odom", Odometry(child_frame_id="base"), room.now, STAMP)
    message = next_bytes(room, client.number)["msg"]
    assert message == {"secs": 5, "nsecs": 7, "bytes": encode(Odometry(child_frame_id="base"))}


def test_clients_of_one_topic_may_want_different_forms() -> None:
    room = Room()
    plain, packed = room.client(), room.client()
    plain.does("subscribe", topic="/level")
    packed.does("subscribe", topic="/level", compression="cbor")
    room.arrives("/level", Float32(data=0.5))
    assert plain.gets()[0]["msg"] == {"data": 0.5}
    assert next_bytes(room, packed.number)["msg"] == {"data": 0.5}
