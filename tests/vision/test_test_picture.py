"""The picture that is made in place of a camera."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.vision.components.test_picture import bars, with_square
from rbxcompose.msgs.sensor_msgs import Image
from rbxcompose.testing import Bench, instance


def test_it_publishes_pictures_of_its_size_at_its_rate() -> None:
    config = {"width": 64, "height": 48, "rate": "5 Hz", "topic": "camera/image_raw"}
    bench = Bench(instance("camera", "test_picture", config))
    pictures = bench.collect("/camera/image_raw", Image)
    bench.advance(1.0)
    assert 5 <= len(pictures) <= 6
    assert {(one.width, one.height, one.step, len(one.data)) for one in pictures} == {(64, 48, 192, 64 * 48 * 3)}
    assert len({bytes(one.data) for one in pictures}) == len(pictures)  # something moves


@given(st.integers(16, 300), st.integers(16, 300), st.floats(0, 1e6))
def test_the_square_is_whole_at_any_time(width: int, height: int, time: float) -> None:
    shown = with_square(bars(width, height), time)
    side = max(2, min(width, height) // 6)
    assert shown.shape == (height, width, 3)
    assert int((shown == 255).all(axis=2).sum()) == side * side
