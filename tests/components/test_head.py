"""A head with simulated servos looks at objects, links and points, follows a point, and tells why it cannot."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.compiler.plan.model import Instance
from rbxcompose.domains.arms.motion.gaze import past
from rbxcompose.domains.arms.section_models import HeadTracking
from rbxcompose.msgs.control_msgs import PointHead
from rbxcompose.msgs.geometry_msgs import Point, PointStamped, Pose, PoseStamped, Transform, TransformStamped, Vector3
from rbxcompose.msgs.rbxcompose_msgs import LookAtPoint
from rbxcompose.msgs.stamps import to_duration, to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.msgs.visualization_msgs import Marker
from rbxcompose.sdk.bound import Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.components.slow_servos import with_slow_servos
from tests.conftest import ROOT
from tests.loops import for_all
from tests.parts.project import Project
from tests.shipped import compiled, robot_and_plan
from tests.soak import rare

TYPES = ("head", "servo_bus", "scene", "transforms")


@pytest.fixture(scope="module")
def parts() -> dict[str, Instance]:
    _, plan = robot_and_plan("pi_robot", "table")
    return {instance.type: instance for instance in with_slow_servos(plan.instances) if instance.type in TYPES}


def robot(parts: dict[str, Instance], **changes: object) -> Bench:
    """Return a head whose configuration is changed; without a type that is changed to None."""
    kept = {name: instance for name, instance in parts.items() if changes.get(name, instance) is not None}
    config = parts["head"].config.model_copy(update={name: to for name, to in changes.items() if name not in TYPES})
    bench = Bench(*(kept | {"head": replace(parts["head"], config=config)}).values())
    bench.advance(0.5)
    return bench


@pytest.fixture(scope="module")
def standing(parts: dict[str, Instance]) -> Bench:
    """Return a head whose goals are all refused, so that it stays as it is."""
    return robot(parts)


def looked(bench: Bench, goal: LookAtPoint.Goal) -> tuple[Outcome, LookAtPoint.Result | None]:
    ends: list[Any] = []
    bench.bus.action_client("me", "/head/look_at", LookAtPoint)(goal, ends.append)
    for _ in range(100):
        bench.advance(0.1)
        if ends:
            return ends[0].outcome, ends[0].result
    raise AssertionError("it does not end")


def angle_to(bench: Bench, point: tuple[float, float, float]) -> float:
    """Return by how much the camera looks past a point of the root's frame now [rad]."""
    head: Any = bench.component("head")
    return past(head.body.poses(head.positions)["camera_depth_frame"].inverse().apply(point))


def test_it_ends_when_the_camera_looks_at_an_object(parts: dict[str, Instance]) -> None:
    bench = robot(parts)
    outcome, result = looked(bench, LookAtPoint.Goal(object="box1"))
    assert outcome is Outcome.SUCCEEDED
    assert result is not None
    assert result.angle < math.radians(1)
    bench.advance(0.5)
    assert angle_to(bench, (0.27, -0.12, 0.78)) < math.radians(1)


@for_all(
    "goal, changes, reason, said",
    [
        (
            LookAtPoint.Goal(object="cup"),
            {},
            "unknown_object",
            "there is no object 'cup' in the scene; there: box1, box2",
        ),
        (LookAtPoint.Goal(x=1.0, frame="nowhere"), {}, "unknown_goal", "there is no link 'nowhere'"),
        (LookAtPoint.Goal(x=1.0, frame="map"), {}, "unknown_goal", "there is no link 'map'"),
        (LookAtPoint.Goal(x=1.0, frame="map"), {"frames": ("map",)}, "unknown_scene", "map"),
        (LookAtPoint.Goal(x=-5.0, z=0.8), {}, "goal_out_of_reach", "deg past it, more than 1.0 deg: 'head_pan_joint'"),
        (LookAtPoint.Goal(frame="camera_depth_frame"), {}, "goal_out_of_reach", "the point is within the camera"),
        (LookAtPoint.Goal(object="box1"), {"scene": None}, "unknown_scene", "no planning scene has been received"),
        (LookAtPoint.Goal(object="box1"), {"sees_scene": False}, "unknown_scene", "this robot has no scene"),
        (
            LookAtPoint.Goal(x=1.0),
            {"servo_bus": None},
            "unknown_start",
            "nothing has reported where 'head_pan_joint' is",
        ),
        (LookAtPoint.Goal(x=1.0, z=0.9, duration=1e-3), {}, "not_followed", "head_"),
    ],
)
def test_a_failure_names_its_reason(
    parts: dict[str, Instance],
    standing: Bench,
    goal: LookAtPoint.Goal,
    changes: dict[str, object],
    reason: str,
    said: str,
) -> None:
    outcome, result = looked(robot(parts, **changes) if changes else standing, goal)
    assert outcome is Outcome.ABORTED
    assert result is not None
    assert result.outcome == reason
    assert said in result.message


def test_numbers_that_are_none_are_refused(parts: dict[str, Instance]) -> None:
    bench = robot(parts)
    for goal in (LookAtPoint.Goal(x=math.nan), LookAtPoint.Goal(tolerance=-1.0)):
        assert looked(bench, goal)[0] is Outcome.REJECTED


def test_a_tolerance_lets_it_look_past_what_it_cannot_turn_to(parts: dict[str, Instance]) -> None:
    outcome, result = looked(robot(parts), LookAtPoint.Goal(x=-5.0, z=0.8, tolerance=math.radians(60)))
    assert outcome is Outcome.SUCCEEDED
    assert result is not None
    assert math.radians(10) < result.angle < math.radians(60)


def test_a_newer_goal_replaces_an_older_one_and_a_cancelled_one_lets_the_head_rest(parts: dict[str, Instance]) -> None:
    bench = robot(parts)
    ends: list[Any] = []
    client = bench.bus.action_client("me", "/head/look_at", LookAtPoint)
    client(LookAtPoint.Goal(x=-1.0, y=2.0, z=0.8), ends.append)
    bench.advance(0.4)
    second = client(LookAtPoint.Goal(x=-1.0, y=-2.0, z=0.8), ends.append)
    bench.advance(0.4)
    second.cancel()
    bench.advance(1.0)
    assert [end.outcome for end in ends] == [Outcome.ABORTED, Outcome.CANCELED]
    head: Any = bench.component("head")
    at = dict(head.positions)
    bench.advance(1.0)
    assert head.positions == pytest.approx(at, abs=2e-3)
    assert looked(bench, LookAtPoint.Goal(x=1.0, z=0.8))[0] is Outcome.SUCCEEDED


def test_a_point_that_moves_is_followed(parts: dict[str, Instance]) -> None:
    bench = robot(parts)
    off = []
    for step in range(50):
        point = (1.0, math.sin(step / 40), 1.0)
        message = PointStamped(header=Header(), point=Point(x=point[0], y=point[1], z=point[2]))
        bench.publish("/head/target", message)
        bench.advance(0.05)
        off.append(angle_to(bench, point))
    assert max(off[30:]) < math.radians(8)
    bench.publish("/head/target", PointStamped(header=Header(frame_id="nowhere")))
    assert any("a target is not followed: there is no link 'nowhere'" in text for text in bench.texts())


@pytest.mark.parametrize("mode", ["speed", *rare("position")])
@pytest.mark.parametrize("rate", [10, *rare(20)])
def test_a_target_at_30_degrees_a_second_is_kept_within_3_degrees(
    parts: dict[str, Instance], mode: str, rate: int
) -> None:
    bench = robot(parts, tracks=HeadTracking.model_validate({"mode": mode}))
    off = []

    def place(time: float) -> tuple[float, float, float]:
        angle = math.radians(40) * math.sin(0.75 * time)  # at 30 deg/s in the middle
        return 1.5 * math.cos(angle), 1.5 * math.sin(angle), 1.0

    for cycle in range(100):
        if cycle % (20 // rate) == 0:
            bench.publish("/head/target", PointStamped(header=Header(), point=Point(*place(cycle * 0.05))))
        bench.advance(0.05)
        off.append(angle_to(bench, place((cycle + 1) * 0.05)))
    assert max(off[30:]) < math.radians(3)


def head_that(*sets: str, profile: str = "") -> tuple[Bench, Any]:
    """Return a head of two servos whose manifest is changed, and its component."""
    profiles = [profile] if profile else []
    made = compiled(str(ROOT / "robots/head_only"), profiles=profiles, sets=sets, environment={})
    assert made.plan is not None
    bench = Bench(plan=made.plan)
    bench.advance(0.5)
    return bench, bench.component("head")


def past_point(head: Any, point: tuple[float, float, float]) -> float:
    return past(head.body.poses(head.positions)["camera_depth_frame"].inverse().apply(point))


def test_poses_on_a_topic_are_followed_until_they_are_lost() -> None:
    bench, head = head_that("heads.head.tracks.topic=target_pose", "heads.head.tracks.recentre=500 ms")
    for _ in range(40):
        bench.publish("/target_pose", PoseStamped(Header(), Pose(Point(1.0, 0.5, 0.2))))
        bench.advance(0.05)
    assert past_point(head, (1.0, 0.5, 0.2)) < math.radians(1)
    bench.advance(6.0)
    assert head.positions == pytest.approx(dict.fromkeys(head.positions, 0.0), abs=0.05)


def test_a_frame_is_followed_until_nobody_says_where_it_is() -> None:
    bench, head = head_that("heads.head.tracks.frame=tag_box")
    for _ in range(40):
        at = Transform(Vector3(1.0, -0.5, 0.2))
        placed = TransformStamped(Header(to_time(bench.clock.stamp()), head.body.root), "tag_box", at)
        bench.publish("/tf", TFMessage(transforms=(placed,)), Qos.STATE)
        bench.advance(0.05)
    assert past_point(head, (1.0, -0.5, 0.2)) < math.radians(1)
    bench.advance(1.5)
    assert head.tracker.state != "follows"


NODDING = """body: {urdf: neck.urdf}
world: ../../room.yaml
buses: {servos: {type: dynamixel}}
actuators: {one: {bus: servos, model: AX-12, id: 1}, two: {bus: servos, model: AX-12, id: 2}}
joints: {pan: {actuator: one}, tilt: {actuator: two}}
controllers: {neck: {type: joint_trajectory, joints: [pan, tilt]}}
heads: {head: {camera: eye, controller: neck, tracks: {frame: tag_box, mode: position}}}
components: {base: {type: diff_drive_sim}}
cameras: {front: {frame: eye, size: [320, 240], view: 60 deg}}
tags: {size: 20 cm, names: {box: 7}}
"""
TAGGED_ROOM = """rbx: 1
kind: World
name: room
objects:
  box:
    box: [4 cm, 30 cm, 30 cm]
    at: {x: 1.5 m, y: 20 cm, heading: 190 deg}
    z: 20 cm
    tags: {front: {number: 7, size: 20 cm}}
spawn: {start: {}}
"""
NECK = """<robot name="neck"><link name="base_footprint"/><link name="nape"/><link name="eye"/>
<joint name="pan" type="revolute"><parent link="base_footprint"/><child link="nape"/><origin xyz="0.05 0 0.4"/>
<axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="3" effort="1"/></joint>
<joint name="tilt" type="revolute"><parent link="nape"/><child link="eye"/><origin xyz="0.03 0 0.06"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="3" effort="1"/></joint></robot>
"""


def test_a_head_stands_before_a_tag_that_stands(tmp_path: Path) -> None:
    pytest.importorskip("cv2", reason="OpenCV is not installed")
    (tmp_path / "robots/one").mkdir(parents=True)
    (tmp_path / "robots/one/neck.urdf").write_text(NECK)
    (tmp_path / "room.yaml").write_text(TAGGED_ROOM)
    bench = Bench(plan=Project(tmp_path).check(NODDING).plan)
    head: Any = bench.component("head")
    bench.advance(2.0)
    places = []
    for _ in range(40):
        bench.advance(0.05)
        places.append((head.positions["pan"], head.positions["tilt"]))
    assert head.tracker.state == "follows"
    for angles in zip(*places, strict=True):
        assert max(angles) - min(angles) < math.radians(5)  # a simulated camera draws joints a moment late


def test_a_frame_counts_once_for_each_time_that_it_is_seen() -> None:
    bench, head = head_that("heads.head.tracks.frame=tag_box", "heads.head.tracks.lost=200 ms")
    at = Transform(Vector3(1.0, -0.5, 0.2))
    placed = TransformStamped(Header(to_time(bench.clock.stamp()), head.body.root), "tag_box", at)
    bench.publish("/tf", TFMessage(transforms=(placed,)), Qos.STATE)
    bench.advance(0.15)
    assert head.tracker.state == "follows"
    bench.advance(0.15)
    assert head.tracker.state != "follows"


@pytest.mark.soak  # it is one more that is followed, by a robot of the library
def test_the_target_of_the_book_is_followed() -> None:
    bench, head = head_that(profile="tracking")
    told = bench.collect("/target_pose", PoseStamped, Qos.COMMAND)
    markers = bench.collect("/target_marker", Marker)
    off = []
    bench.advance(2.0)
    for _ in range(200):
        bench.advance(0.05)
        at = told[-1].pose.position
        link = head.body.poses(head.positions)[told[-1].header.frame_id]
        off.append(past_point(head, link.apply((at.x, at.y, at.z))))
    assert max(off) < math.radians(16)  # it turns around at once, twice in each round
    assert sorted(off)[len(off) // 2] < math.radians(3)
    assert markers[-1].pose.position == told[-1].pose.position
    ys = [one.pose.position.y for one in told]
    assert (min(ys), max(ys)) == pytest.approx((-0.2, 0.2), abs=0.01)


def pointed(bench: Bench, **goal: Any) -> tuple[Outcome, str, float]:
    """Return how a goal of `point_head` ends, what is said, and how long it took [s]."""
    ends: list[Any] = []
    goal = {"target": PointStamped(Header(), Point(1.0, 0.4, 1.0)), **goal}
    bench.bus.action_client("me", "/head/point_head", PointHead)(PointHead.Goal(**goal), ends.append)
    for cycle in range(200):
        bench.advance(0.05)
        if ends:
            return ends[0].outcome, ends[0].message, cycle * 0.05
    raise AssertionError("it does not end")


def test_any_link_that_the_head_turns_is_pointed_along_any_axis(parts: dict[str, Instance]) -> None:
    bench = robot(parts)
    assert pointed(bench)[0] is Outcome.SUCCEEDED
    assert angle_to(bench, (1.0, 0.4, 1.0)) < math.radians(1)
    optical = {"pointing_frame": "camera_depth_optical_frame", "pointing_axis": Vector3(z=2.0)}
    goal = PointStamped(Header(), Point(1.0, -0.4, 1.0))
    assert pointed(bench, target=goal, **optical)[0] is Outcome.SUCCEEDED
    assert angle_to(bench, (1.0, -0.4, 1.0)) < math.radians(1)


def test_its_velocity_and_its_duration_are_kept(parts: dict[str, Instance]) -> None:
    bench = robot(parts)
    assert pointed(bench, min_duration=to_duration(2.0))[2] >= 2.0
    assert pointed(bench, target=PointStamped(Header(), Point(1.0, -0.4, 1.0)), max_velocity=0.3)[2] >= 2.0


@pytest.mark.parametrize(
    ("goal", "outcome"),
    [
        ({"target": PointStamped(Header(), Point(math.nan, 0.0, 0.0))}, Outcome.REJECTED),
        ({"pointing_frame": "nose"}, Outcome.REJECTED),
        ({"pointing_frame": "base_link"}, Outcome.REJECTED),
        ({"max_velocity": -1.0}, Outcome.REJECTED),
        ({"target": PointStamped(Header(frame_id="nowhere"), Point(1.0, 0.0, 1.0))}, Outcome.ABORTED),
        ({"target": PointStamped(Header(), Point(-5.0, 0.0, 0.8))}, Outcome.ABORTED),
    ],
)
def test_what_cannot_be_pointed_at_fails(standing: Bench, goal: dict[str, Any], outcome: Outcome) -> None:
    assert pointed(standing, **goal)[0] is outcome
