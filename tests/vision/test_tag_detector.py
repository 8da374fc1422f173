"""The component that finds tags: what it publishes, and what it says when it cannot."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rbxcompose.base.geometry import Transform3
from rbxcompose.base.levels import Level
from rbxcompose.msgs.poses import pose_of, transform_of
from rbxcompose.msgs.sensor_msgs import CameraInfo, Image
from rbxcompose.msgs.stamps import to_nanoseconds, to_time
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.msgs.vision_msgs import Detection3DArray
from rbxcompose.testing import Bench, instance
from tests.vision.tagged import CAMERA, facing, picture

pytest.importorskip("cv2", reason="OpenCV is not installed")
SIZE = 0.15
OPTICAL = Header(frame_id="camera_optical_frame")
INFO = CameraInfo(
    OPTICAL, 480, 640, "plumb_bob", np.zeros(5), np.ravel(CAMERA.matrix), np.ravel(np.eye(3)), np.zeros(12)
)


class Seeing:
    """A detector before a camera."""

    def __init__(self, info: CameraInfo | None = INFO, **config: Any) -> None:
        self.bench = Bench(instance("tags", "tag_detector", {"size": f"{SIZE} m", **config}))
        self.seen = self.bench.collect("/tags", Detection3DArray)
        self.placed = self.bench.collect("/tf", TFMessage)
        self.near = self.bench.collect("/nearest_tag", String)
        if info is not None:
            self.bench.publish("/camera_info", info)
        self.bench.advance(0.1)

    def sees(self, tags: dict[int, Transform3]) -> dict[str, Transform3]:
        """Return what it sees in a picture of tags, by name."""
        shot = picture(tags, SIZE)
        self.takes(Image(OPTICAL, 480, 640, "mono8", 0, 640, shot.tobytes()))
        return {one.id: pose_of(one.results[0].pose.pose) for one in self.seen[-1].detections}

    def takes(self, image: Image) -> None:
        self.bench.publish("/image_raw", image)
        self.bench.advance(0.1)

    def state(self) -> tuple[int, str]:
        statuses = self.bench.statuses("tags")
        self.bench.advance(2.0)
        return statuses[-1].level, statuses[-1].message


def test_it_publishes_tags_by_name_with_poses_and_transforms_of_those_that_have_a_name() -> None:
    seeing = Seeing(names={"box": 7})
    found = seeing.sees({7: facing(0.2, 0, 1.5), 12: facing(-0.2, 0, 1)})
    assert found["box"].translation == pytest.approx((0.2, 0, 1.5), abs=0.02)
    assert found["12"].translation == pytest.approx((-0.2, 0, 1), abs=0.02)
    ((placed,),) = (message.transforms for message in seeing.placed)
    assert (placed.header.frame_id, placed.child_frame_id) == (OPTICAL.frame_id, "tag_box")
    assert transform_of(placed.transform) == found["box"]
    assert seeing.near[-1].data == "12"
    names = [[one.hypothesis.class_id for one in seen.results] for seen in seeing.seen[-1].detections]
    assert names == [["box", "7"], ["12"]]
    assert seeing.sees({}) == {}
    assert seeing.near[-1].data == ""


def test_a_board_has_a_pose_by_its_tags() -> None:
    places = [{"number": 1, "x": "-20 cm"}, {"number": 2, "x": "20 cm"}]
    seeing = Seeing(boards={"charger": {"tags": places}})
    board = facing(0.1, 0.05, 2)
    found = seeing.sees({1: board.compose(Transform3((-0.2, 0, 0))), 2: board.compose(Transform3((0.2, 0, 0)))})
    assert found["charger"].translation == pytest.approx(board.translation, abs=0.02)
    assert {"1", "2"} < set(found)


@pytest.mark.parametrize(
    ("info", "problem"),
    [
        (None, "no camera_info has come"),
        (CameraInfo(OPTICAL, 480, 640, "plumb_bob"), "the camera is not calibrated"),
        (CameraInfo(OPTICAL, 480, 640, "fish"), "the distortion model 'fish' is not known"),
        (
            CameraInfo(OPTICAL, 240, 320, "plumb_bob", k=INFO.k),
            "pictures are 640 x 480, and camera_info is of 320 x 240",
        ),
    ],
)
def test_without_a_calibration_it_tells_which_tags_there_are_but_not_where(
    info: CameraInfo | None, problem: str
) -> None:
    seeing = Seeing(info)
    seeing.sees({7: facing(0, 0, 1)})
    (one,) = seeing.seen[-1].detections
    assert (one.id, one.results[0].hypothesis.score) == ("7", 0.0)
    assert seeing.placed == []
    level, message = seeing.state()
    assert message.startswith(problem)
    assert level == Level.ERROR


def test_what_is_no_picture_is_reported_and_not_published() -> None:
    seeing = Seeing()
    seeing.takes(Image(OPTICAL, 480, 640, "mono8", 0, 640, b"too short"))
    seeing.takes(Image(OPTICAL, 480, 640, "yuv", 0, 640, bytes(640 * 480)))
    assert seeing.seen == []
    level, message = seeing.state()
    assert level == Level.ERROR
    assert message.startswith("the encoding 'yuv' is not known")


def test_of_two_tags_with_one_name_the_one_that_was_there_keeps_it() -> None:
    seeing = Seeing(names={"box": 7})
    seeing.sees({7: facing(0.3, 0, 1.5)})
    shot = np.minimum(picture({7: facing(0.3, 0, 1.5)}, SIZE), picture({7: facing(-0.3, 0, 1.0)}, SIZE))
    seeing.takes(Image(OPTICAL, 480, 640, "mono8", 0, 640, shot.tobytes()))
    assert [one.id for one in seeing.seen[-1].detections] == ["box", "box"]
    assert [one.transform.translation.x for one in seeing.placed[-1].transforms] == pytest.approx([0.3], abs=0.02)
    assert seeing.state() == (Level.ERROR, "the tag 'box' is seen twice")


def test_a_picture_of_the_future_has_no_transforms_and_one_without_a_time_is_of_now() -> None:
    seeing = Seeing(names={"box": 7})
    shot = picture({7: facing(0, 0, 1)}, SIZE).tobytes()
    seeing.takes(Image(OPTICAL, 480, 640, "mono8", 0, 640, shot))
    assert abs(to_nanoseconds(seeing.placed[-1].transforms[0].header.stamp) - seeing.bench.clock.stamp()) < 2e8
    late = Header(stamp=to_time(seeing.bench.clock.stamp() + 3_000_000_000), frame_id=OPTICAL.frame_id)
    seeing.takes(Image(late, 480, 640, "mono8", 0, 640, shot))
    assert (len(seeing.placed), len(seeing.seen)) == (1, 2)
    level, message = seeing.state()
    assert (level, message) == (Level.ERROR, "pictures are stamped 3.0 s in the future: is the camera's clock right?")


def test_a_camera_that_freezes_is_reported() -> None:
    seeing = Seeing()
    seeing.sees({})
    seeing.bench.advance(4)
    level, message = seeing.state()
    assert level == Level.ERROR
    assert message.startswith("no picture for")
    assert [text for text in seeing.bench.texts() if "no picture" in text] == ["tags: no picture for 3 s"]


@pytest.mark.parametrize(
    ("config", "told"),
    [
        ({"names": {"box": 7}, "sizes": {"bxo": "20 cm"}}, "'names' has no tag 'bxo'"),
        ({"names": {"box": 7, "dock": 7}}, "the same number"),
        ({"names": {"box": 7}, "boards": {"box": {"tags": [{"number": 1}]}}}, "the same name: box"),
        ({"boards": {"box": {"tags": [{"number": 1}, {"number": 1}]}}}, "each tag once"),
    ],
)
def test_names_and_sizes_that_do_not_fit_are_refused(config: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        Seeing(**config)
