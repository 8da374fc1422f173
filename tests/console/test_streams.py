"""Streams of pictures: one encoding for all who want the same, and nothing while nobody looks."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from rbxcompose.domains.console import video as module
from rbxcompose.domains.console.video import Picture, Streams
from rbxcompose.msgs.sensor_arrays import WrongPictureError
from rbxcompose.msgs.sensor_msgs import Image

TOPIC = "/camera"


def want(width: int = 0, topic: str = TOPIC) -> Picture:
    return Picture(topic, "jpeg", width, 0, 95, is_inverted=False)


def image(value: int) -> Image:
    return Image(height=1, width=1, encoding="mono8", step=1, data=bytes((value,)))


class Camera:
    """A topic with pictures, and what was encoded of them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.listeners: list[Callable[[Any], None]] = []
        self.encoded: list[tuple[int, int]] = []
        self.gate = asyncio.Event()
        self.streams = Streams({TOPIC: Image.TYPE, "/odom": "nav_msgs/msg/Odometry"}.get, self.subscribe)  # type: ignore[arg-type]
        monkeypatch.setattr(module, "encoded", self.encode)
        monkeypatch.setattr(asyncio, "to_thread", self.to_thread)

    def encode(self, message: Image, want: Picture) -> bytes:
        value = bytes(message.data)[0]
        if value == 255:
            raise WrongPictureError("broken")
        self.encoded.append((value, want.width))
        return bytes((value,))

    async def to_thread(self, function: Callable[..., bytes], *arguments: Any) -> bytes:
        await self.gate.wait()
        return function(*arguments)

    def subscribe(self, topic: str, message: object, then: Callable[[Any], None]) -> Any:
        self.listeners.append(then)
        return lambda: self.listeners.remove(then)

    async def shows(self, *values: int) -> None:
        for value in values:
            for listener in self.listeners:
                listener(image(value))
        for _ in range(10):
            await asyncio.sleep(0)


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[Camera], Awaitable[None]]], None]:
    async def with_camera(what: Callable[[Camera], Awaitable[None]]) -> None:
        camera = Camera(monkeypatch)
        camera.gate.set()
        await what(camera)

    return lambda what: asyncio.run(with_camera(what))


Run = Callable[[Callable[[Camera], Awaitable[None]]], None]


def test_viewers_of_the_same_share_an_encoding_and_the_topic(run: Run) -> None:
    async def look(camera: Camera) -> None:
        viewers = [camera.streams.frames(want()), camera.streams.frames(want()), camera.streams.frames(want(8))]
        first = [asyncio.ensure_future(anext(viewer)) for viewer in viewers]
        await camera.shows()
        assert len(camera.listeners) == 1
        await camera.shows(7)
        assert await asyncio.gather(*first) == [b"\x07"] * 3
        assert sorted(camera.encoded) == [(7, 0), (7, 8)]
        for viewer in viewers:
            assert camera.listeners
            await viewer.aclose()
        assert camera.listeners == []

    run(look)


def test_frames_that_are_overtaken_are_never_encoded(run: Run) -> None:
    async def look(camera: Camera) -> None:
        camera.gate.clear()
        viewer = camera.streams.frames(want())
        first = asyncio.ensure_future(anext(viewer))
        await camera.shows()
        await camera.shows(1)
        await camera.shows(2, 3, 4)
        camera.gate.set()
        await camera.shows()
        assert await first in (b"\x01", b"\x04")
        assert camera.encoded == [(1, 0), (4, 0)]
        await viewer.aclose()

    run(look)


def test_what_cannot_be_shown_says_why_and_leaves_nothing(run: Run) -> None:
    async def look(camera: Camera) -> None:
        for topic, why in (("/odom", "its messages are 'nav_msgs/msg/Odometry'"), ("/none", "no such topic")):
            with pytest.raises(WrongPictureError, match=why):
                await camera.streams.snapshot(want(topic=topic))
        snapshot = asyncio.ensure_future(camera.streams.snapshot(want()))
        await camera.shows()
        await camera.shows(255)
        with pytest.raises(WrongPictureError, match="broken"):
            await snapshot
        assert camera.listeners == []

    run(look)


def test_there_are_so_many_different_streams_at_most(run: Run) -> None:
    async def look(camera: Camera) -> None:
        viewers = [camera.streams.frames(want(width)) for width in range(1, module.MOST_STREAMS + 1)]
        waiting = [asyncio.ensure_future(anext(viewer)) for viewer in viewers]
        await camera.shows()
        with pytest.raises(WrongPictureError, match="different streams already"):
            await camera.streams.snapshot(want(4000))
        for task in waiting:
            task.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)

    run(look)
