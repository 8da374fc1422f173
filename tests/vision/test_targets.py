"""What heads and arms may follow: frames, tags, and what is nearest in a cloud."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rbxcompose.base.geometry import Transform3
from rbxcompose.base.levels import Level
from rbxcompose.domains.worlds.optics import Intrinsics, cloud_message
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped, PoseWithCovariance, TransformStamped
from rbxcompose.msgs.poses import transform_message
from rbxcompose.msgs.sensor_msgs import PointCloud2
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.msgs.vision_msgs import (
    BoundingBox3D,
    Detection3D,
    Detection3DArray,
    ObjectHypothesis,
    ObjectHypothesisWithPose,
)
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

CAMERA = Intrinsics.of_view(64, 48, math.radians(60))
OPTICAL = Header(frame_id="camera_optical_frame")


class Targets:
    """A component that publishes targets."""

    def __init__(self, name: str, **config: Any) -> None:
        self.bench = Bench(instance("it", name, config))
        self.told = self.bench.collect("/target_pose", PoseStamped, Qos.COMMAND)
        self.statuses = self.bench.statuses("it")
        self.bench.advance(0.1)

    def after(self, topic: str, message: Any, qos: Qos = Qos.STATE) -> list[tuple[float, float, float]]:
        self.told.clear()
        self.bench.publish(topic, message, qos)
        self.bench.advance(0.1)
        return [(one.pose.position.x, one.pose.position.y, one.pose.position.z) for one in self.told]


def tag(name: str, x: float, score: float = 1.0) -> Detection3D:
    pose = Pose(Point(x, 2 * x, 1.0))
    result = ObjectHypothesisWithPose(ObjectHypothesis(name, score), PoseWithCovariance(pose, np.zeros(36)))
    return Detection3D(Header(), (result,), BoundingBox3D(center=pose), name)


def test_the_middle_of_tags_is_that_of_those_that_are_seen_and_count() -> None:
    targets = Targets("tags_cog", tags=["a", "b"])
    seen = Detection3DArray(OPTICAL, (tag("a", 0.0), tag("b", 0.4), tag("c", 9.0), tag("a", math.nan)))
    assert targets.after("/tags", seen) == [pytest.approx((0.2, 0.4, 1.0))]
    assert targets.told[0].header == OPTICAL
    assert targets.after("/tags", Detection3DArray(OPTICAL, (tag("a", 0.1), tag("b", 5.0, score=0.0)))) == [
        pytest.approx((0.1, 0.2, 1.0))
    ]
    assert targets.after("/tags", Detection3DArray(OPTICAL, (tag("c", 1.0),))) == []
    assert len(Targets("tags_cog").after("/tags", seen)) == 1
    numbered = replace(tag("c", 9.0), results=tag("c", 9.0).results + tag("7", 9.0).results)
    assert Targets("tags_cog", tags=["7"]).after("/tags", Detection3DArray(OPTICAL, (numbered,))) == [(9.0, 18.0, 1.0)]


def cloud(depths: Any) -> PointCloud2:
    return cloud_message(OPTICAL, CAMERA.rays, depths.astype(np.float32), np.zeros((48, 64, 3), np.uint8))


def test_what_is_nearest_in_a_cloud_is_the_target_and_noise_is_not() -> None:
    targets = Targets("nearest_cloud", z=["30 cm", "2 m"])
    depths = np.full((48, 64), 1.5)
    depths[20:28, 10:18] = 0.8
    depths[40, 40] = 0.4  # noise
    depths[:, 60:] = np.nan
    ((x, y, z),) = targets.after("/camera/points", cloud(depths), Qos.BULK)
    middle = CAMERA.rays[20:28, 10:18].reshape(-1, 3).mean(0) * 0.8
    assert (x, y, z) == pytest.approx(middle.tolist(), abs=0.02)


@pytest.mark.parametrize("depths", [np.full((48, 64), np.nan), np.full((48, 64), 9.0), np.full((48, 64), 0.1)])
def test_without_anything_near_there_is_no_target(depths: Any) -> None:
    assert Targets("nearest_cloud").after("/camera/points", cloud(depths), Qos.BULK) == []


def test_what_is_no_cloud_is_reported() -> None:
    targets = Targets("nearest_cloud")
    assert targets.after("/camera/points", PointCloud2(OPTICAL, 1, 5), Qos.BULK) == []
    targets.bench.advance(2.0)
    assert targets.statuses[-1].level == Level.ERROR
    assert "no field 'x'" in targets.statuses[-1].message


def test_a_frame_is_told_as_soon_as_somebody_knows_it() -> None:
    targets = Targets("frame_target", frame="hand", stands_in="base_link")
    targets.bench.advance(1.5)
    assert targets.told == []
    assert targets.statuses[-1].level == Level.WARN
    header = Header(to_time(targets.bench.clock.stamp()), "base_link")
    placed = TransformStamped(header, "hand", transform_message(Transform3((0.3, 0.2, 0.1))))
    found = targets.after("/tf", TFMessage(transforms=(placed,)))
    assert found[-1] == pytest.approx((0.3, 0.2, 0.1))
    assert targets.told[-1].header.frame_id == "base_link"
