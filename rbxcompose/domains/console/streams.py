"""Streams of pictures: the newest frame of a topic, encoded once for all who want the same."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable
from typing import Any

from rbxcompose.domains.console.video import IMAGES, Picture, encoded
from rbxcompose.msgs import registry
from rbxcompose.msgs.images import WrongPictureError
from rbxcompose.msgs.types import Message

MOST_STREAMS = 32  # pictures that differ
FIRST = 10.0  # [s] for the first picture of a topic
BOUNDARY = "boundarydonotcross"  # as web_video_server has it, which some viewers expect


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
