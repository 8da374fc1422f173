"""Pictures of a camera: a film stands in for it, as there is none where tests run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rbxcompose.base.levels import Level
from rbxcompose.domains.vision.components.usb_camera import UsbCamera
from rbxcompose.msgs.sensor_msgs import Image
from rbxcompose.testing import Bench, instance

cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed")
COLOURS = ((200, 0, 0), (0, 200, 0), (0, 0, 200))  # blue, green, red


def film(path: Path) -> Path:
    """Write three pictures, each of one colour."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 5, (64, 48))
    for colour in COLOURS:
        writer.write(np.full((48, 64, 3), colour, np.uint8))
    writer.release()
    return path


def bench_of(device: Path) -> Bench:
    return Bench(instance("camera", "usb_camera", {"device": str(device), "rate": "5 Hz", "topic": "front/image"}))


def test_pictures_have_the_colours_that_the_camera_saw(tmp_path: Path) -> None:
    bench = bench_of(film(tmp_path / "film.avi"))
    pictures = bench.collect("/front/image", Image)
    bench.advance(0.7)
    assert [(one.width, one.height, one.step, one.encoding) for one in pictures] == [(64, 48, 192, "bgr8")] * 3
    for one, colour in zip(pictures, COLOURS, strict=True):
        assert np.allclose(np.frombuffer(bytes(one.data), np.uint8)[:3], colour, atol=6)


def test_a_film_begins_again_without_a_word(tmp_path: Path) -> None:
    bench = bench_of(film(tmp_path / "film.avi"))
    pictures, statuses = bench.collect("/front/image", Image), bench.statuses("camera")
    bench.advance(2.0)
    assert len(pictures) == 10
    assert bytes(pictures[3].data) == bytes(pictures[0].data)
    assert {status.level for status in statuses} <= {Level.OK, Level.STALE}
    assert not [text for text in bench.texts() if "gives no more" in text]


def test_a_camera_that_ends_is_reported_and_opened_again(tmp_path: Path) -> None:
    bench = bench_of(path := film(tmp_path / "film.avi"))
    pictures = bench.collect("/front/image", Image)
    bench.advance(1.0)
    camera = bench.component("camera")
    assert isinstance(camera, UsbCamera)
    assert camera.camera is not None
    camera.camera.release()  # as if it were unplugged
    bench.advance(0.3)
    assert (camera.state.level, camera.state.message) == (Level.ERROR, f"{path} gives no more pictures")
    count = len(pictures)
    bench.advance(2.0)
    assert len(pictures) > count


def test_a_camera_that_is_not_there_is_waited_for(tmp_path: Path) -> None:
    bench = bench_of(path := tmp_path / "film.avi")
    pictures = bench.collect("/front/image", Image)
    bench.advance(1.0)
    camera = bench.component("camera")
    assert isinstance(camera, UsbCamera)
    assert (camera.state.level, camera.state.message) == (Level.ERROR, f"{path} cannot be opened")
    assert not pictures
    film(path)
    bench.advance(2.0)
    assert pictures
