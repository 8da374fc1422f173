"""A robot with a camera finds what stands on a table: by name, in the frame of the camera, or says why not."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbxcompose.base.geometry import Transform3
from rbxcompose.base.levels import Level
from rbxcompose.domains.vision.components.tabletop_detector import TabletopDetector
from rbxcompose.domains.worlds.optics import cloud_message
from rbxcompose.msgs.geometry_msgs import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from rbxcompose.msgs.moveit_msgs import CollisionObject
from rbxcompose.msgs.poses import pose_of
from rbxcompose.msgs.rbxcompose_msgs import FindObjects
from rbxcompose.msgs.sensor_msgs import PointCloud2
from rbxcompose.msgs.shape_msgs import SolidPrimitive
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
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from tests.navigation.test_robot import Room
from tests.vision import tables

pytestmark = pytest.mark.timeout(120)
OPTICAL = "eye_optical_frame"
BODY = """<robot name="looker"><link name="base_footprint"/><link name="base_link"><collision><origin xyz="0 0 0.5"/>
<geometry><cylinder radius="0.17" length="1"/></geometry></collision></link><link name="eye_link"/>
<joint name="body" type="fixed"><parent link="base_footprint"/><child link="base_link"/></joint>
<joint name="neck" type="fixed"><parent link="base_link"/><child link="eye_link"/>
<origin xyz="0.1 0 1.15" rpy="0 0.5 0"/></joint></robot>"""
ROBOT = f"""body: {{urdf: looker.urdf}}
world: ../../room.yaml
components:
  base: {{type: diff_drive_sim}}
  eye: {{type: camera_sim, frame: eye_link, topic: eye, depth: DEPTH, noise: 1 mm, rate: 5 Hz, size: [320, 240]}}
  squares:
    {{type: tag_detector, image: eye/image_raw, info: eye/camera_info, frame: {OPTICAL}, names: {{tea: 7}}, size: 8 cm}}
  finder: {{type: tabletop_detector, points: eye/points, frame: {OPTICAL}, level: odom, tags: tags, EXTRA}}
"""
TABLE = """rbx: 1
kind: World
name: table
objects:
  table: {box: [70 cm, 120 cm, 4 cm], at: {x: 1 m}, z: 70 cm}
"""
THINGS = """  carton:
    {box: [6 cm, 10 cm, 12 cm], at: {x: 85 cm, y: 20 cm, heading: 180 deg}, z: 74 cm, tags: {front: 7}}
  can: {cylinder: {radius: 35 mm, length: 10 cm}, at: {x: 80 cm, y: -15 cm}, z: 74 cm}
"""
AT = {"tea": (0.85, 0.2, 0.8), "thing_1": (0.8, -0.15, 0.79)}


class Looker:
    """A robot before a table, and how its goals end."""

    def __init__(
        self, folder: Path, world: str = TABLE + THINGS, depth: bool = True, extra: str = "rate: 5 Hz"
    ) -> None:
        (folder / "robots/one").mkdir(parents=True)
        (folder / "robots/one/looker.urdf").write_text(BODY)
        text = ROBOT.replace("DEPTH", str(depth).lower()).replace("EXTRA", extra)
        self.bench = Room(folder, text, world).bench
        self.seen = self.bench.collect("/objects", Detection3DArray)
        self.tables = self.bench.collect("/table", Detection3DArray)
        self.statuses = self.bench.statuses("finder")
        self.bench.advance(1.0)

    def finds(self, **goal: Any) -> Ended[FindObjects.Result]:
        ends: list[Ended[FindObjects.Result]] = []
        client = self.bench.bus.action_client("me", "/find_objects", FindObjects)
        client(FindObjects.Goal(**goal), ends.append)
        self.bench.run_until(lambda: bool(ends), 20.0)
        return ends[0]

    def found(self, **goal: Any) -> FindObjects.Result:
        result = self.finds(**goal).result
        assert result is not None
        return result

    def places(self) -> dict[str, tuple[float, ...]]:
        """Return where things were seen last, in `odom` [m]."""
        component = self.bench.component("finder")
        assert isinstance(component, TabletopDetector)
        camera: Transform3 = component.bound["look"].transform()
        return {
            one.id: camera.compose(pose_of(one.bbox.center)).translation
            for message in (self.seen[-1], self.tables[-1])
            for one in message.detections
        }


def test_things_have_names_shapes_and_places_and_a_tag_names_its_thing(tmp_path: Path) -> None:
    looker = Looker(tmp_path, extra="rate: 5 Hz, pictures: 2")
    assert looker.seen == []  # nobody has asked
    found = looker.found(least=2)
    assert (found.count, found.names, found.outcome) == (2, ("thing_1", "tea"), "")
    assert (found.tagged, found.untagged) == (("tea",), ("thing_1",))
    places = looker.places()
    for name, where in AT.items():
        assert math.dist(places[name], where) < 0.008
    assert places["table"] == pytest.approx((1.0, 0.0, 0.73), abs=0.02)
    last = looker.seen[-1]
    assert last.header.frame_id == OPTICAL
    assert {one.id: one.results[0].hypothesis.class_id for one in last.detections} == {
        "thing_1": "cylinder",
        "tea": "box",
    }
    assert all(one.results[0].hypothesis.score > 0.5 for one in last.detections)
    assert looker.found().names == found.names
    count = len(looker.seen)
    looker.bench.advance(1.0)
    assert len(looker.seen) == count


@pytest.mark.parametrize(
    ("world", "depth", "goal", "outcome", "why"),
    [
        pytest.param(
            TABLE, True, {"duration": 0.7}, "none_found", "nothing stands on the table", marks=pytest.mark.soak
        ),
        pytest.param(
            TABLE + THINGS,
            True,
            {"least": 3, "duration": 0.7},
            "too_few",
            "2 of 3 things stand on the table",
            marks=pytest.mark.soak,
        ),
        pytest.param(
            TABLE.replace("z: 70 cm", "z: 5 cm"),
            True,
            {"duration": 1.0},
            "no_table",
            "nothing as large as a table",
            marks=pytest.mark.soak,
        ),
        (TABLE + THINGS, False, {"duration": 3.0}, "not_seen", "no cloud on 'eye/points' for"),
    ],
)
def test_without_what_is_wanted_it_fails_with_the_reason(
    tmp_path: Path, world: str, depth: bool, goal: dict[str, Any], outcome: str, why: str
) -> None:
    looker = Looker(tmp_path, world, depth)
    found = looker.found(**goal)
    assert found.outcome == outcome
    assert why in found.message
    looker.bench.advance(0.2)
    if outcome in ("no_table", "not_seen"):
        assert looker.statuses[-1].level == Level.WARN
        assert why in looker.statuses[-1].message


@pytest.mark.soak
def test_what_never_stands_still_is_not_steady(tmp_path: Path) -> None:
    path = "path: [[0 s, 80 cm, -20 cm], [4 s, 80 cm, 20 cm]]"
    can = f"  can: {{cylinder: {{radius: 35 mm, length: 10 cm}}, z: 74 cm, {path}}}\n"
    looker = Looker(tmp_path, TABLE + can, extra="rate: 5 Hz, pictures: 5")
    assert looker.found(duration=1.5).outcome == "not_steady"


def test_a_cloud_of_another_camera_or_without_points_is_told_and_not_used(tmp_path: Path) -> None:
    looker = Looker(tmp_path, depth=False, extra="rate: 5 Hz, continuous: true")
    for frame, why in (("nose", "it is in 'nose', and expected in"), (OPTICAL, "it has no field 'x'")):
        cloud = PointCloud2(header=Header(frame_id=frame), width=1, height=1, data=np.zeros(12, np.uint8).tobytes())
        looker.bench.publish("/eye/points", cloud, qos=Qos.BULK)
        looker.bench.advance(0.3)
        assert why in looker.statuses[-1].message
        assert looker.statuses[-1].level == Level.WARN
    assert looker.seen == []


def test_a_goal_that_is_no_time_is_refused_and_one_that_is_cancelled_ends(tmp_path: Path) -> None:
    looker = Looker(tmp_path, TABLE, depth=False)
    assert looker.finds(duration=math.nan).outcome is Outcome.REJECTED
    assert any("its duration is not finite" in text for text in looker.bench.texts())
    ends: list[Ended[FindObjects.Result]] = []
    sent = looker.bench.bus.action_client("me", "/find_objects", FindObjects)(FindObjects.Goal(), ends.append)
    looker.bench.advance(0.5)
    sent.cancel()
    looker.bench.advance(0.2)
    assert [end.outcome for end in ends] == [Outcome.CANCELED]


def test_too_few_pictures_are_no_things_that_move_and_silence_is_logged_once(tmp_path: Path) -> None:
    looker = Looker(tmp_path, extra="rate: 5 Hz, pictures: 9, continuous: true")
    assert looker.found(duration=0.7).message == "only 2 of 9 pictures have come"
    silent = Looker(tmp_path / "other", depth=False, extra="rate: 5 Hz, continuous: true")
    silent.bench.advance(6.0)
    assert len([text for text in silent.bench.texts() if text.startswith("finder: no cloud")]) == 1


@pytest.mark.parametrize("round_", [True, False])
def test_what_is_round_comes_into_the_planning_scene_as_a_cylinder(round_: bool) -> None:
    where = Pose(position=Point(x=0.8, z=0.79), orientation=Quaternion(w=1.0))
    size = Vector3(x=0.07, y=0.07 if round_ else 0.09, z=0.1)
    result = ObjectHypothesisWithPose(ObjectHypothesis(class_id="cylinder", score=0.9), PoseWithCovariance(pose=where))
    seen = Detection3D(Header(), (result,), BoundingBox3D(where, size), "can")
    bench = Bench(instance("seeing", "seen_objects", {"frame": "eye", "stands_in": "base"}))
    frame = TransformStamped(Header(frame_id="base"), "eye", Transform(rotation=Quaternion(w=1.0)))
    bench.publish("/tf_static", TFMessage(transforms=(frame,)), Qos.LATCHED)
    added = bench.collect("/collision_object", CollisionObject)
    bench.publish("/detections", Detection3DArray(Header(), (seen,)))
    [shape] = added[-1].primitives
    assert shape.type == (SolidPrimitive.CYLINDER if round_ else SolidPrimitive.BOX)
    assert shape.dimensions == pytest.approx([0.1, 0.035] if round_ else [0.07, 0.09, 0.1])


@pytest.mark.parametrize("is_known", [True, False])
def test_a_cloud_waits_until_it_is_known_where_the_camera_was_and_not_for_ever(is_known: bool) -> None:
    settings = {"points": "points", "frame": "eye", "rate": "5 Hz", "pictures": 2}
    bench = Bench(instance("finder", "tabletop_detector", settings))
    ends: list[Ended[FindObjects.Result]] = []
    pose, black = tables.eye(), np.zeros((240, 320, 3), np.uint8)
    depths = tables.cloud((tables.TABLE, tables.box(0.8, 0.0, (0.06, 0.06, 0.1))), pose)[..., 2].astype(np.float32)
    message = cloud_message(Header(), tables.CAMERA.rays, depths, black)
    bench.bus.action_client("me", "/find_objects", FindObjects)(FindObjects.Goal(duration=2.0), ends.append)
    at = Transform(Vector3(*pose.translation), Quaternion(*pose.rotation))
    for _ in range(25):
        if ends:
            break
        seen = Header(to_time(bench.clock.stamp()), "eye")
        bench.publish("/points", replace(message, header=seen), Qos.BULK)
        bench.advance(0.1)
        if is_known:  # half a picture late
            placed = TransformStamped(Header(seen.stamp, "base_footprint"), "eye", at)
            bench.publish("/tf", TFMessage(transforms=(placed,)))
    [end] = ends
    assert end.result is not None
    if is_known:
        assert end.result.names == ("thing_1",)
    else:
        assert end.result.outcome == "not_seen"
        assert "a cloud is not used: " in end.result.message
        assert "there is no frame" in end.result.message
