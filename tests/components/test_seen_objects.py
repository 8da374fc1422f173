"""What a camera sees comes into the scene, where the camera was when it saw it, and goes out of it again."""

from __future__ import annotations

from typing import Any

import pytest

from rbxcompose.compiler.plan.model import Instance
from rbxcompose.msgs.geometry_msgs import Point, Pose, Quaternion, Vector3
from rbxcompose.msgs.rbxcompose_msgs import AttachObject, DetachObject, SceneObjects
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.vision_msgs import (
    BoundingBox3D,
    Detection3D,
    Detection3DArray,
    ObjectHypothesis,
    ObjectHypothesisWithPose,
)
from rbxcompose.testing import Bench
from tests.components.slow_servos import with_slow_servos
from tests.shipped import robot_and_plan

TYPES = ("seen_objects", "scene", "servo_bus", "transforms")
TURNED = Quaternion(x=0.5, y=-0.5, z=0.5, w=0.5)  # upright, as the optical frame sees it


@pytest.fixture(scope="module")
def parts() -> list[Instance]:
    _, plan = robot_and_plan("pi_robot", "seeing")
    slow = with_slow_servos(plan.instances, 5.0)  # the arm hangs still
    return [instance for instance in slow if instance.type in TYPES]


class Camera:
    """A robot that sees, and what its scene tells."""

    def __init__(self, parts: list[Instance]) -> None:
        self.bench = Bench(*parts)
        self.scenes = self.bench.collect("/scene", SceneObjects)
        self.near = self.bench.collect("/nearest_object", String)
        self.bench.advance(0.5)

    def sees(self, *found: Detection3D, frame: str = "", after: float = 0.1) -> None:
        self.bench.publish("/detections", Detection3DArray(header=Header(frame_id=frame), detections=found))
        self.bench.advance(after)

    @property
    def there(self) -> dict[str, tuple[float, ...]]:
        """Return where things other than the table are [m]."""
        found = {
            placed_object.name: placed_object.pose.position
            for scene in self.scenes[-1:]
            for placed_object in scene.objects
            if placed_object.name != "table"
        }
        return {name: (round(at.x, 3), round(at.y, 3), round(at.z, 3)) for name, at in found.items()}

    def asks(self, service: Any, topic: str, request: Any) -> None:
        self.bench.bus.client("me", topic, service)(request, lambda reply: None)
        self.bench.advance(0.1)


def thing(x: float = 0.0125, score: float = 0.9, side: float = 0.02, turn: Quaternion = TURNED) -> Detection3D:
    what = ObjectHypothesisWithPose(hypothesis=ObjectHypothesis(class_id="cup", score=score))
    pose = Pose(position=Point(x=x, y=0.3875, z=0.2975), orientation=turn)
    return Detection3D(results=(what,), bbox=BoundingBox3D(center=pose, size=Vector3(x=side, y=side, z=0.1)))


def test_things_stand_where_they_are_as_seen_from_the_body_and_are_gone_after_a_while(parts: list[Instance]) -> None:
    camera = Camera(parts)
    camera.sees(thing(), thing(-0.1875), frame="camera_depth_optical_frame")
    assert camera.there == {"cup_1": (0.24, 0.0, 0.765), "cup_2": (0.24, 0.2, 0.765)}
    camera.sees(thing(0.0625), after=20.0)
    assert camera.there["cup_1"] == (0.24, -0.05, 0.765)
    camera.bench.advance(5.0)
    assert camera.near[-1].data == "cup_1"
    camera.bench.advance(5.0)
    assert set(camera.there) == {"cup_1"}  # the other was seen before it
    camera.bench.advance(10.0)
    assert camera.there == {}
    assert camera.near[-1].data == ""


def test_what_is_held_stays_in_the_hand_and_is_known_where_it_was_put(parts: list[Instance]) -> None:
    camera = Camera(parts)
    camera.sees(thing())
    camera.asks(AttachObject, "/scene/attach", AttachObject.Request(object="cup_1", link="right_gripper_link"))
    camera.sees(thing(0.0625))
    [held] = [object_ for object_ in camera.scenes[-1].objects if object_.name == "cup_1"]
    assert held.link == "right_gripper_link"
    camera.bench.advance(40.0)
    assert "cup_1" in camera.there
    assert camera.near[-1].data == ""
    camera.asks(DetachObject, "/scene/detach", DetachObject.Request(object="cup_1"))
    camera.sees(thing())
    assert camera.there == {"cup_1": (0.24, 0.0, 0.765)}


@pytest.mark.parametrize(
    ("found", "frame", "said"),
    [
        (thing(score=0.4), "", ""),
        (thing(side=0.0), "", "a detection is no box of 1 mm to 10 m"),
        (thing(x=float("nan")), "", "a detection is no box"),
        (thing(turn=Quaternion(w=0.0)), "", "a detection is no box"),
        (thing(), "map", "detections are in 'map', and expected in 'camera_depth_optical_frame'"),
    ],
)
def test_what_is_no_box_or_uncertain_or_in_another_frame_is_left_out(
    parts: list[Instance], found: Detection3D, frame: str, said: str
) -> None:
    camera = Camera(parts)
    camera.sees(found, frame=frame)
    assert camera.there == {}
    warned = [text for text in camera.bench.texts() if "detection" in text]
    assert said in " ".join(warned)
    assert bool(warned) == bool(said)
