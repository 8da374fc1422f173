"""The component that keeps the planning scene: what it tells arms and viewers, and what changes it from outside."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion import octree_files
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.motion.scene_messages import object_message
from rbxcompose.domains.body.description import rooted_text
from rbxcompose.domains.body.model import Geometry
from rbxcompose.msgs.builtin_interfaces import Time
from rbxcompose.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from rbxcompose.msgs.moveit_msgs import (
    AllowedCollisionEntry,
    AllowedCollisionMatrix,
    ApplyPlanningScene,
    AttachedCollisionObject,
    CollisionObject,
    GetPlanningScene,
    LinkPadding,
    LinkScale,
    ObjectColor,
    PlanningScene,
    PlanningSceneWorld,
    RobotState,
)
from rbxcompose.msgs.octomap_msgs import Octomap, OctomapWithPose
from rbxcompose.msgs.poses import pose_message
from rbxcompose.msgs.rbxcompose_msgs import SceneObjects
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.shape_msgs import Mesh, Plane, SolidPrimitive
from rbxcompose.msgs.std_msgs import ColorRGBA, Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.msgs.types import Message
from rbxcompose.msgs.visualization_msgs import MarkerArray
from rbxcompose.runtime.channel import Repeated
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from tests.body.test_virtual_joint import WORLD
from tests.loops import for_all
from tests.motion.toy_arm import urdf

BOX = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=np.array((0.1, 0.2, 0.3)))
CYLINDER = SolidPrimitive(type=SolidPrimitive.CYLINDER, dimensions=np.array((0.3, 0.05)))
BALL = {"link": "map", "shapes": [{"kind": "sphere", "size": [0.05]}], "position": [1.0, 0.0, 0.0]}
CELLS = Geometry("octree", (0.02,), points=(0.0, 0.0, 0.0))
THERE = pose_message(Transform3((0.3, 0.0, 0.2)))
CHANGES: tuple[tuple[str, type[Message]], ...] = (
    ("/collision_object", CollisionObject),
    ("/attached_collision_object", AttachedCollisionObject),
    ("/planning_scene", PlanningScene),
)


class Scene:
    """A scene on a bench, and what it tells."""

    def __init__(self, **config: object) -> None:
        self.bench = Bench(instance("scene", "scene", {"urdf": urdf(), **config}))
        self.told = self.bench.collect("/scene", SceneObjects, Qos.LATCHED)
        self.markers = self.bench.collect("/scene_markers", MarkerArray, Qos.LATCHED)
        self.bench.advance(0.1)

    def send(self, message: Message) -> None:
        topic = next(topic for topic, kind in CHANGES if isinstance(message, kind))
        self.bench.publish(topic, message, Qos.EVENT)
        self.bench.advance(0.1)

    def box(self, name: str = "box", operation: int = CollisionObject.ADD, **fields: Any) -> None:
        shapes = {"primitives": (BOX,)} if operation in (CollisionObject.ADD, CollisionObject.APPEND) else {}
        self.send(CollisionObject(**{"id": name, "pose": THERE, "operation": operation, **shapes, **fields}))

    def ask(self, topic: str, service: type[Any], request: Any) -> Any:
        answers: list[Reply[Any]] = []
        self.bench.bus.client("me", topic, service)(request, answers.append)
        self.bench.advance(0.1)
        return answers[0].response

    @property
    def names(self) -> list[str]:
        return [object_.name for object_ in self.told[-1].objects]

    def refusal(self) -> str:
        return self.bench.texts()[-1]


def place_base(bench: Bench, x: float) -> None:
    pose = Transform(translation=Vector3(x=x), rotation=Quaternion(w=1.0))
    header = Header(stamp=Time(sec=round(bench.clock.now()) + 1), frame_id="map")
    link = TransformStamped(header=header, child_frame_id="ground", transform=pose)
    bench.publish("/tf", TFMessage(transforms=(link,)), Qos.STATE)
    bench.advance(0.3)


def test_an_object_in_the_map_is_where_it_is_as_seen_from_the_body_which_drives() -> None:
    scene = Scene(objects={"ball": BALL}, frames=["map"])
    assert scene.told == []  # frames become known soon
    scene.bench.advance(2.0)
    assert scene.told[-1].problem == "no transform to 'map' is known, the frame of 'ball'"
    place_base(scene.bench, 0.4)
    assert scene.told[-1].problem == ""
    (object_,) = scene.told[-1].objects
    assert object_.link == "ground"
    assert object_.pose.position.x == pytest.approx(0.6)
    count = len(scene.told)
    place_base(scene.bench, 0.4)
    assert len(scene.told) == count  # it has not moved
    place_base(scene.bench, 0.5)
    assert scene.told[-1].objects[0].pose.position.x == pytest.approx(0.5)


def test_objects_from_outside_are_added_extended_moved_and_removed() -> None:
    scene = Scene()
    scene.box()
    scene.box("can", primitives=(CYLINDER, BOX), primitive_poses=(THERE, THERE))
    can = scene.told[-1].objects[1]
    assert [shape.kind for shape in can.shapes] == ["cylinder", "box"]
    assert can.shapes[0].size.tolist() == [0.05, 0.3]  # radius and length, the other way round in MoveIt
    there = pose_message(Transform3((0.0, 0.7, 0.0)))
    scene.box(operation=CollisionObject.APPEND, pose=there)
    assert scene.told[-1].objects[0].shapes[1].pose.position.y == pytest.approx(0.7)
    scene.box("can", CollisionObject.MOVE, pose=there)
    moved = scene.markers[-1].markers[3].pose.position
    assert (moved.x, moved.y) == pytest.approx((0.3, 0.7))  # its shapes are where they were in its frame
    assert len(scene.markers[-1].markers) == 1 + 4  # the first one deletes those of before
    scene.box(operation=CollisionObject.REMOVE)
    assert scene.names == ["can"]
    scene.box("", CollisionObject.REMOVE)
    assert scene.names == []


def test_a_link_that_never_moves_holds_nothing() -> None:
    scene = Scene(urdf=rooted_text(urdf(), "ground", WORLD))
    scene.box(header=Header(frame_id="ground"))
    scene.box(operation=CollisionObject.APPEND, header=Header(frame_id="world"))
    scene.box("can", header=Header(frame_id="turret"))
    scene.box("can", CollisionObject.MOVE, header=Header(frame_id="ground"))
    scene.box("ball", planes=(Plane(coef=np.array((0.0, 0.0, 1.0, 0.0))),), primitives=(), plane_poses=(THERE,))
    assert [(placed_object.name, placed_object.link) for placed_object in scene.told[-1].objects] == [
        (text, "world") for text in ("box", "can", "ball")
    ]
    scene.box("", CollisionObject.REMOVE)
    assert scene.names == []


@for_all(
    "fields, reason",
    [
        ({"id": ""}, "a name has 1 to 200 letters"),
        ({"primitives": ()}, "'box' has no shapes"),
        ({"pose": pose_message(Transform3((math.nan, 0.0, 0.0)))}, "its pose is not finite"),
        ({"pose": pose_message(Transform3(rotation=(0.0,) * 4))}, "its orientation is no rotation"),
        ({"header": Header(frame_id="moon")}, "there is no link 'moon'"),
        ({"primitives": (SolidPrimitive(type=9),)}, "there is no shape of the type 9"),
        ({"primitives": (SolidPrimitive(type=1, dimensions=np.zeros(2)),)}, "the size of a box is x, y, z"),
        ({"primitives": (SolidPrimitive(type=1, dimensions=np.zeros(3)),)}, "a length of its box is 0 m"),
        ({"primitive_poses": (THERE, THERE)}, "1 shapes of one kind and 2 poses"),
        ({"meshes": (Mesh(),), "primitives": ()}, "its mesh has no points"),
        ({"planes": (Plane(),)}, "its normal is not 1"),
        ({"operation": 7}, "there is no operation 7"),
        ({"operation": CollisionObject.MOVE, "primitives": ()}, "there is no object 'box' to move"),
        ({"operation": CollisionObject.REMOVE}, "there is no object 'box' in the scene"),
        ({"id": "fore"}, "'fore' is a link of the body"),
    ],
)
def test_what_cannot_be_is_refused_with_the_reason_and_changes_nothing(fields: dict[str, Any], reason: str) -> None:
    scene = Scene()
    scene.box(**fields)
    assert reason in scene.refusal()
    assert scene.names == []


def test_an_object_is_attached_and_detached_and_stays_where_it_is() -> None:
    scene = Scene()
    scene.bench.publish("/joint_states", JointState(name=("turn",), position=np.array((0.5,))), Qos.STATE)
    scene.box()
    scene.send(AttachedCollisionObject(link_name="tip", object=CollisionObject(id="box"), touch_links=("fore",)))
    (held,) = scene.told[-1].objects
    assert (held.link, held.touches) == ("tip", ("fore",))
    scene.send(AttachedCollisionObject(object=CollisionObject(id="box", operation=CollisionObject.REMOVE)))
    (free,) = scene.told[-1].objects
    assert free.link == "ground"
    assert free.pose.position.x == pytest.approx(0.3)
    new = CollisionObject(id="pen", primitives=(BOX,))
    scene.send(AttachedCollisionObject(link_name="tip", object=new))
    assert scene.told[-1].objects[1].link == "tip"
    scene.send(AttachedCollisionObject(object=CollisionObject(id="ball", operation=CollisionObject.REMOVE)))
    assert "no link holds 'ball'" in scene.refusal()


def world(*objects: CollisionObject, **fields: Any) -> PlanningSceneWorld:
    return PlanningSceneWorld(collision_objects=objects, **fields)


def test_a_planning_scene_is_applied_and_told_again_as_it_was() -> None:
    scene, box = Scene(), CollisionObject(id="box", pose=THERE, primitives=(BOX,))
    matrix = AllowedCollisionMatrix(
        entry_names=("box", "fore", "can"),
        entry_values=tuple(AllowedCollisionEntry(enabled=(False, True, True)) for _ in range(3)),
    )
    held = AttachedCollisionObject(link_name="tip", object=CollisionObject(id="can", primitives=(CYLINDER,)))
    wanted = PlanningScene(
        world=world(box),
        robot_state=RobotState(attached_collision_objects=(held,)),
        object_colors=(ObjectColor(id="box", color=ColorRGBA(r=1.0, a=1.0)),),
        link_padding=(LinkPadding(link_name="fore", padding=0.02),),
        allowed_collision_matrix=matrix,
        is_diff=True,
    )
    request = ApplyPlanningScene.Request(scene=wanted)
    assert scene.ask("/apply_planning_scene", ApplyPlanningScene, request).success
    told = scene.told[-1]
    assert (told.objects[0].touches, told.objects[0].touches_objects) == (("fore",), ("can",))
    assert (told.padded_links, told.paddings.tolist()) == (("fore",), [0.02])
    found = scene.ask("/get_planning_scene", GetPlanningScene, GetPlanningScene.Request()).scene
    (back,) = found.world.collision_objects
    assert (back.id, back.primitives[0].dimensions.tolist()) == ("box", [0.1, 0.2, 0.3])
    assert found.robot_state.attached_collision_objects[0].object.id == "can"
    assert found.object_colors[0].color.r == 1.0
    scene.send(PlanningScene())  # no difference: the whole scene
    assert (scene.names, scene.told[-1].padded_links) == ([], ())


@pytest.mark.parametrize(
    ("wanted", "reason"),
    [
        (PlanningScene(link_scale=(LinkScale(link_name="fore", scale=2.0),)), "cannot be scaled"),
        (PlanningScene(link_padding=(LinkPadding(link_name="hand"),)), "there is no link 'hand'"),
        (PlanningScene(link_padding=(LinkPadding(link_name="fore", padding=math.nan),)), "from 0 to 1 m"),
        (PlanningScene(object_colors=(ObjectColor(id="ball"),)), "no object 'ball' to colour"),
        (PlanningScene(world=world(octomap=OctomapWithPose(octomap=Octomap(data=np.ones(2, np.int8))))), "binary"),
    ],
)
def test_a_planning_scene_is_applied_whole_or_not_at_all(wanted: PlanningScene, reason: str) -> None:
    scene = Scene(paddings={"upper": 0.01})
    scene.box()
    answer = scene.ask("/apply_planning_scene", ApplyPlanningScene, ApplyPlanningScene.Request(scene=wanted))
    assert not answer.success
    assert reason in scene.refusal()
    found = scene.ask("/get_planning_scene", GetPlanningScene, GetPlanningScene.Request()).scene
    assert [collision_object.id for collision_object in found.world.collision_objects] == ["box"]
    assert [one.link_name for one in found.link_padding] == ["upper"]


def test_an_octomap_becomes_cells() -> None:
    tree = Octomap(binary=True, id="OcTree", resolution=0.1, data=np.array(octomap_of_one_cell(), dtype=np.int8))
    scene = Scene()
    scene.send(PlanningScene(is_diff=True, world=world(octomap=OctomapWithPose(octomap=tree))))
    (object_,) = scene.told[-1].objects
    assert (object_.name, object_.shapes[0].kind) == ("<octomap>", "octree")
    assert object_.shapes[0].points.tolist() == pytest.approx([0.05, 0.05, 0.05])


def test_an_octomap_of_too_many_nodes_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(octree_files, "MOST_NODES", 1000)
    tree = Octomap(binary=True, id="OcTree", resolution=0.1, data=np.full(4000, -1, dtype=np.int8))
    scene = Scene()
    scene.send(PlanningScene(is_diff=True, world=world(octomap=OctomapWithPose(octomap=tree))))
    assert "there are more than 1,000 nodes" in scene.refusal()


def octomap_of_one_cell() -> list[int]:
    """Return the bits of a tree whose only occupied cell is the first above the origin: child 7, then 0, and so on."""
    first, inner, last = 3 << 14, 3, 2
    return [byte for bits in (first, *[inner] * 14, last) for byte in np.array([bits], "<u2").view(np.int8).tolist()]


def test_many_objects_that_come_one_by_one_are_published_together() -> None:
    scene = Scene()
    before = len(scene.told)
    for number in range(100):
        one = CollisionObject(id=f"box {number}", primitives=(BOX,))
        scene.bench.bus.publisher("me", "/collision_object", CollisionObject, Qos.EVENT)(one)
    scene.bench.advance(0.2)
    assert len(scene.names) == 100
    assert len(scene.told) - before == 2


def test_more_objects_than_there_may_be_are_refused() -> None:
    many = tuple(CollisionObject(id=f"box {number}", primitives=(BOX,)) for number in range(1_001))
    scene = Scene()
    scene.send(PlanningScene(is_diff=True, world=world(*many)))
    assert "shapes, and may be 1,000" in scene.refusal()
    assert scene.names == []


def restarted(scene: Scene, *, kept: bool) -> None:
    """Start the scene again as in a new process, whose supervisor sends what was kept a little later."""
    host = scene.bench.host
    requests = [event for event in scene.bench.events if isinstance(event, Repeated)][-1].requests
    host.is_restart = True
    host.prepare(scene.bench.plan.instances)
    host.activate(["scene"])
    scene.bench.advance(0.05)
    for request in requests if kept else ():
        host.recall("scene", request)
    scene.bench.advance(0.3)


def test_after_a_restart_the_scene_is_as_it_was() -> None:
    scene = Scene(objects={"ball": BALL, "pen": BALL | {"link": "ground"}}, frames=["map"])
    place_base(scene.bench, 0.4)
    scene.send(PlanningScene(is_diff=True, link_padding=(LinkPadding(link_name="fore", padding=0.02),)))
    scene.box()
    scene.box("pen", CollisionObject.REMOVE)
    scene.send(AttachedCollisionObject(link_name="tip", object=CollisionObject(id="ball")))
    before, count = scene.told[-1], len(scene.told)
    restarted(scene, kept=True)
    assert (scene.names, scene.told[-1]) == (["ball", "box"], before)
    assert len(scene.told) == count + 1  # nothing else was published meanwhile
    scene.send(AttachedCollisionObject(object=CollisionObject(id="ball", operation=CollisionObject.REMOVE)))
    assert component(scene).things.objects["ball"].link == "map"
    scene.bench.host.failed("scene", RuntimeError("planted"))
    scene.bench.advance(2.0)
    assert scene.names == ["ball", "box"]
    assert component(scene).things.objects["ball"].link == "map"


def test_a_scene_that_starts_again_without_one_from_before_has_what_is_there_from_the_start() -> None:
    scene = Scene(objects={"pen": BALL | {"link": "ground"}})
    scene.box()
    restarted(scene, kept=False)
    assert scene.names == ["pen"]


def test_what_changes_before_the_scene_from_before_a_restart_has_come_stays_changed() -> None:
    scene = Scene(objects={"pen": BALL | {"link": "ground"}})
    scene.box()
    restarted(scene, kept=False)
    scene.box("can")
    kept = [event for event in scene.bench.events if isinstance(event, Repeated)]
    scene.bench.host.recall("scene", kept[1].requests[0])
    scene.bench.advance(0.1)
    assert scene.names == ["pen", "box", "can"]


def test_a_scene_is_kept_when_it_changes_and_without_what_clouds_show() -> None:
    scene = Scene(clouds=["cells"], objects={"ball": BALL}, frames=["map"])
    place_base(scene.bench, 0.4)
    place_base(scene.bench, 0.5)
    seen = SceneObjects(objects=(object_message(PlacedObject("cells", CELLS, "ground", Transform3())),))
    scene.bench.publish("/scene/cells", seen, Qos.LATCHED)
    scene.bench.advance(0.1)
    assert scene.names == ["ball", "cells"]
    (kept,) = [event for event in scene.bench.events if isinstance(event, Repeated)]
    assert [thing["name"] for thing in kept.requests[0]["objects"]] == ["ball"]


def component(scene: Scene) -> Any:
    return scene.bench.component("scene")
