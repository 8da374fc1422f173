"""Pictures of topics for browsers, with the parameters of web_video_server: as JPEG and PNG, single and in streams."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Iterable, Mapping
from html import escape
from io import BytesIO
from typing import Any, Literal
from urllib.parse import quote

from rbxcompose.base.dataclass import dataclass
from rbxcompose.msgs import registry
from rbxcompose.msgs.sensor_arrays import WrongPictureError, pixels
from rbxcompose.msgs.sensor_msgs import CompressedImage, Image
from rbxcompose.msgs.types import Message

IMAGES = (Image.TYPE, CompressedImage.TYPE)
LARGEST = 4096  # pixels of a side
_MOST_PIXELS = LARGEST**2  # to decode or to scale to: a few bytes may stand for gigabytes
_COMPRESSED = ("JPEG", "PNG", "TIFF", "WEBP", "BMP")  # what cameras send; Pillow decodes some others to open them
_FORMS = {"mjpeg": "jpeg", "jpeg": "jpeg", "png": "png", "ros_compressed": "jpeg"}
_QUALITY = {"jpeg": 95, "png": 3}
_QUALITIES = {"jpeg": (1, 100), "png": (0, 9)}
MOST_STREAMS = 32  # pictures that differ
FIRST = 10.0  # [s] for the first picture of a topic
BOUNDARY = "boundarydonotcross"  # as web_video_server has it, which some viewers expect


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture as viewers want it; those that want the same share it. A size of 0 is that of the camera."""

    topic: str
    form: Literal["jpeg", "png"]
    width: int
    height: int
    quality: int
    """Of JPEG from 1 to 100; of PNG how hard it is compressed, from 0 to 9."""
    is_inverted: bool
    """Whether it is turned by half a turn."""

    @property
    def mime(self) -> str:
        """Return its media type."""
        return f"image/{self.form}"


def wanted(query: Mapping[str, str]) -> Picture:
    """Return what the parameters of an address ask for.

    Raises:
        WrongPictureError: if they make no sense.
    """
    # Pages put a second `?` and a random number behind an address, against caches: mjpegcanvas does.
    query = {name.partition("?")[0]: value.partition("?")[0] for name, value in query.items()}
    topic = query.get("topic", "").strip()
    if not topic.strip("/"):
        raise WrongPictureError("'topic' is the name of a topic with pictures")
    written = query.get("type", "mjpeg")
    if (form := _FORMS.get(written)) is None:
        raise WrongPictureError(f"'type' is one of {', '.join(_FORMS)}, not '{written[:40]}'")
    return Picture(
        f"/{topic.lstrip('/')}",
        form,  # type: ignore[arg-type]
        _whole(query, "width", 0, (0, LARGEST)),
        _whole(query, "height", 0, (0, LARGEST)),
        _whole(query, "quality", _QUALITY[form], _QUALITIES[form]),
        "invert" in query,
    )


def _whole(query: Mapping[str, str], name: str, otherwise: int, ends: tuple[int, int]) -> int:
    text = query.get(name, "").strip()
    if not text:
        return otherwise
    try:
        value = round(float(text))  # pages compute sizes
    except (ValueError, OverflowError) as error:
        raise WrongPictureError(f"'{name}' is a number") from error
    if not ends[0] <= value <= ends[1]:
        raise WrongPictureError(f"'{name}' is between {ends[0]} and {ends[1]}")
    return value


def viewer_page(query: str) -> str:
    """Return a page that shows a stream of these parameters, as they stand in an address."""
    return f'<!doctype html><html lang="en"><title>Stream</title><img alt="Stream" src="stream?{escape(query)}">'


def list_page(topics: Iterable[str]) -> str:
    """Return a page with links to what can be seen."""
    rows = [
        f'<li>{escape(topic)}: <a href="stream_viewer?topic={quote(topic)}">stream</a>, '
        f'<a href="snapshot?topic={quote(topic)}">snapshot</a></li>'
        for topic in topics
    ]
    shown = f"<ul>{''.join(rows)}</ul>" if rows else "<p>Nothing publishes pictures now.</p>"
    return f'<!doctype html><html lang="en"><title>Streams</title><h1>Streams</h1>{shown}'


def encoded(message: Image | CompressedImage, want: Picture) -> bytes:
    """Return the picture of a message.

    Raises:
        WrongPictureError: if it is none.
    """
    from PIL import Image as Pictures  # of the extra `console`

    if isinstance(message, CompressedImage):
        data = bytes(message.data)
        is_as_wanted = want.form in message.format.lower().replace("jpg", "jpeg") and not (want.width or want.height)
        if is_as_wanted and not want.is_inverted:
            return data
        try:
            header = Pictures.open(BytesIO(data), formats=_COMPRESSED)
            _refuse_large("the compressed picture has", *header.size)
            picture = header.convert("RGB")
        except WrongPictureError:
            raise
        except (OSError, ValueError, SyntaxError, Pictures.DecompressionBombError) as error:
            raise WrongPictureError(f"what is compressed as '{message.format[:40]}' is no picture") from error
    else:
        picture = Pictures.fromarray(pixels(message))
    if want.width or want.height:
        width = want.width or round(picture.width * want.height / picture.height)
        height = want.height or round(picture.height * want.width / picture.width)
        _refuse_large("in this size, the picture would have", width, height)
        picture = picture.resize((max(1, width), max(1, height)), Pictures.Resampling.BILINEAR)
    if want.is_inverted:
        picture = picture.transpose(Pictures.Transpose.ROTATE_180)
    written = BytesIO()
    if want.form == "jpeg":
        picture.save(written, "JPEG", quality=want.quality)
    else:
        picture.save(written, "PNG", compress_level=want.quality)
    return written.getvalue()


def _refuse_large(what: str, width: int, height: int) -> None:
    if width * height > _MOST_PIXELS:
        raise WrongPictureError(f"{what} {width} x {height} pixels; {_MOST_PIXELS} are the most")


class _Stream:
    """One picture of a topic, as some viewers want it."""

    def __init__(self, want: Picture) -> None:
        self.want = want
        self.viewers = 0
        self.frame: bytes = b""
        self.error = ""
        self.changed = asyncio.Event()  # replaced by another one after each frame
        self._newest: Message | None = None
        self._is_busy = False

    def arrived(self, message: Message) -> None:
        """Encode a message, or after the one that is being encoded; one that is overtaken is never encoded."""
        self._newest = message
        if not self._is_busy:
            self._is_busy = True
            self._task = asyncio.get_running_loop().create_task(self._encode())

    async def _encode(self) -> None:
        try:
            while self._newest is not None:
                message, self._newest = self._newest, None
                try:
                    self.frame, self.error = await asyncio.to_thread(encoded, message, self.want), ""  # type: ignore[arg-type]
                except WrongPictureError as error:
                    self.frame, self.error = b"", str(error)
                self.changed.set()
                self.changed = asyncio.Event()
        finally:
            self._is_busy = False


class Streams:
    """All streams of a robot. Topics are subscribed to while somebody looks."""

    def __init__(
        self,
        type_of: Callable[[str], str],
        subscribe: Callable[[str, type[Message], Callable[[Any], None]], Callable[[], None]],
    ) -> None:
        """Use `type_of` for the type of a topic, empty if there is none.

        `subscribe` gets its messages until what it returns is called.
        """
        self._type_of, self._subscribe = type_of, subscribe
        self._streams: dict[Picture, _Stream] = {}
        self._topics: dict[str, Callable[[], None]] = {}

    async def frames(self, want: Picture) -> AsyncGenerator[bytes, None]:
        """Yield pictures, the newest ones only, until the viewer leaves.

        Raises:
            WrongPictureError: if the topic has no pictures, or there are too many streams.
        """
        stream = self._joined(want)
        try:
            while True:
                changed = stream.changed
                if stream.error:
                    raise WrongPictureError(stream.error)
                if stream.frame:
                    yield stream.frame
                await changed.wait()
        finally:
            self._leave(stream)

    async def begun(self, want: Picture) -> tuple[bytes, AsyncGenerator[bytes, None]]:
        """Return the first picture, and those that follow; who takes no more closes them.

        Raises:
            WrongPictureError: if there is none.
        """
        frames = self.frames(want)
        first = asyncio.ensure_future(anext(frames))
        await asyncio.wait({first}, timeout=FIRST)
        if first.done():
            return first.result(), frames
        first.cancel()
        await asyncio.wait({first})
        raise WrongPictureError(f"no picture came on '{want.topic}' in {FIRST:.0f} s")

    async def snapshot(self, want: Picture) -> bytes:
        """Return one picture.

        Raises:
            WrongPictureError: if there is none.
        """
        first, frames = await self.begun(want)
        await frames.aclose()
        return first

    def type_of(self, want: Picture) -> str:
        """Return the type of the messages with a picture.

        Raises:
            WrongPictureError: if the topic has no pictures.
        """
        type_ = self._type_of(want.topic)
        if type_ not in IMAGES:
            what = f"its messages are '{type_}'" if type_ else "there is no such topic"
            raise WrongPictureError(f"'{want.topic}' has no pictures: {what}")
        return type_

    def _joined(self, want: Picture) -> _Stream:
        type_ = self.type_of(want)
        if (stream := self._streams.get(want)) is None:
            if len(self._streams) >= MOST_STREAMS:
                raise WrongPictureError(f"there are {MOST_STREAMS} different streams already")
            stream = self._streams[want] = _Stream(want)
        stream.viewers += 1
        if want.topic not in self._topics:
            message = registry.message(type_)
            self._topics[want.topic] = self._subscribe(want.topic, message, lambda one: self._arrived(want.topic, one))
        return stream

    def _arrived(self, topic: str, message: Message) -> None:
        for stream in self._streams.values():
            if stream.want.topic == topic:
                stream.arrived(message)

    def _leave(self, stream: _Stream) -> None:
        stream.viewers -= 1
        if stream.viewers:
            return
        del self._streams[stream.want]
        topic = stream.want.topic
        if not any(other.want.topic == topic for other in self._streams.values()):
            self._topics.pop(topic)()


def part(frame: bytes, mime: str) -> bytes:
    """Return a picture as a part of a stream."""
    head = f"--{BOUNDARY}\r\nContent-Type: {mime}\r\nContent-Length: {len(frame)}\r\n\r\n"
    return head.encode() + frame + b"\r\n"
