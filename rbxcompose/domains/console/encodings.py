"""Frames of rosbridge in other forms than text: pieces, pictures (PNG) and CBOR."""

from __future__ import annotations

import json
import math
from base64 import b64decode, b64encode
from collections.abc import Iterator, Mapping
from io import BytesIO
from typing import Any

from rbxcompose.base.arrays import np
from rbxcompose.domains.console.json_messages import to_json
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.definitions import OCTETS, FieldShape, attribute, parse_type
from rbxcompose.msgs.types import Message

COMPRESSIONS = ("none", "png", "cbor", "cbor-raw")
SMALLEST_PIECE = 256  # [characters]; clients may ask for fewer, which would cost more than it carries
MOST_PIECES = 100_000
_OPEN = 4  # frames of a client of which not all pieces have come
# RFC 8746: arrays of numbers, little endian.
_TAGS = {"uint8": 64, "uint16": 69, "uint32": 70, "uint64": 71, "int8": 72, "int16": 77, "int32": 78, "int64": 79}
_TAGS |= {"float32": 85, "float64": 86}


class WrongEncodingError(ValueError):
    """Raised for pieces or pictures that hold no frame."""


def pieces(frame: str, size: int, name: str) -> Iterator[str]:
    """Yield a frame as fragments; ids are texts that are not empty, and totals whole numbers, as clients need them."""
    total = math.ceil(len(frame) / size)
    for number in range(total):
        data = frame[number * size : (number + 1) * size]
        yield json.dumps({"op": "fragment", "id": name, "data": data, "num": number, "total": total})


class Pieces:
    """The fragments of a client, until a frame is whole."""

    def __init__(self, largest: int) -> None:
        self._largest = largest  # [characters] of a frame
        self._open: dict[str, dict[int, str]] = {}

    def add(self, data: Mapping[str, Any]) -> str | None:
        """Take a fragment; return the frame if it was the last one that was missing.

        Raises:
            WrongEncodingError: if it is none, or there are too many of them.
        """
        name, number, total, text = (data.get(key) for key in ("id", "num", "total", "data"))
        if not (isinstance(text, str) and isinstance(number, int) and isinstance(total, int)):
            raise WrongEncodingError("a fragment has 'num', 'total' and 'data'")
        if not 0 <= number < total <= MOST_PIECES:
            raise WrongEncodingError(f"'num' is below 'total', which is at most {MOST_PIECES}")
        found = self._open.setdefault(str(name), {})
        found[number] = text
        if sum(map(len, found.values())) > self._largest:
            del self._open[str(name)]
            raise WrongEncodingError(f"a frame has at most {self._largest // 2**20} MiB")
        if len(found) == total:
            del self._open[str(name)]
            return "".join(found[turn] for turn in sorted(found))
        while len(self._open) > _OPEN:
            del self._open[next(iter(self._open))]
        return None


def as_png(frame: str) -> str:
    """Return a frame as the operation `png`: its bytes are the colours of a picture."""
    from PIL import Image  # of the extra `console`

    data = frame.encode()
    width = max(1, math.isqrt(len(data) // 3))
    height = math.ceil(len(data) / 3 / width)
    data += b"\n" * (width * height * 3 - len(data))
    written = BytesIO()
    Image.frombytes("RGB", (width, height), data).save(written, "PNG")
    return json.dumps({"op": "png", "data": b64encode(written.getvalue()).decode()})


def from_png(data: object, largest: int) -> str:
    """Return the frame that is in the data of the operation `png`.

    Raises:
        WrongEncodingError: if there is none.
    """
    from PIL import Image

    if not isinstance(data, str):
        raise WrongEncodingError("'data' is a picture in base64")
    try:
        picture = Image.open(BytesIO(b64decode(data, validate=True)), formats=("PNG",))
        is_huge = picture.width * picture.height * 3 > largest
        frame = "" if is_huge else picture.convert("RGB").tobytes().rstrip(b"\n").decode()
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise WrongEncodingError("'data' is no picture with a frame in it") from error
    if is_huge:
        raise WrongEncodingError(f"a frame has at most {largest // 2**20} MiB")
    return frame


def as_cbor(topic: str, message: Message) -> bytes:
    """Return the operation `publish` in CBOR, arrays of numbers as typed arrays."""
    import cbor2  # of the extra `console`

    return bytes(cbor2.dumps({"op": "publish", "topic": topic, "msg": _cbor(message)}))


def as_raw_cbor(topic: str, message: Message, stamp: int) -> bytes:
    """Return the operation `publish` in CBOR with the message as it is on the bus, and when it came [ns]."""
    import cbor2

    seconds, rest = divmod(stamp, 1_000_000_000)
    content = {"secs": seconds, "nsecs": rest, "bytes": encode(message)}
    return bytes(cbor2.dumps({"op": "publish", "topic": topic, "msg": content}))


def _cbor(message: Message) -> dict[str, Any]:
    import cbor2

    made = to_json(message)
    for name, text in message.FIELDS.items():
        type_, value = parse_type(text), getattr(message, attribute(name))
        if type_.shape is FieldShape.SINGLE:
            if type_.is_message:
                made[name] = _cbor(value)
            elif isinstance(value, float):
                made[name] = value  # CBOR has NaN
        elif type_.is_message:
            made[name] = [_cbor(item) for item in value]
        elif type_.base in OCTETS:
            made[name] = bytes(value)
        elif type_.base in _TAGS:
            array = np.asarray(value, np.dtype(type_.base).newbyteorder("<"))
            made[name] = cbor2.CBORTag(_TAGS[type_.base], array.tobytes())
    return made
