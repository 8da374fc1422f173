"""Tells arms what is around the robot, and what they hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from pydantic import Field

from rbxcompose.base.arrays import np
from rbxcompose.base.findings import Finding
from rbxcompose.base.geometry import Quaternion, Transform3, Vector3, angle_between
from rbxcompose.base.printable import plain
from rbxcompose.domains.arms import scene_view
from rbxcompose.domains.arms.motion.moveit import MoveItScene
from rbxcompose.domains.arms.motion.scene import (
    OCTREE,
    SCENE_LIMITS,
    Colour,
    PlacedObject,
    PlanningScene,
    SceneError,
    ScenePiece,
)
from rbxcompose.domains.arms.motion.scene_messages import markers, object_message, placed_object
from rbxcompose.domains.arms.motion.scene_text import read_scene
from rbxcompose.domains.body.model import Geometry
from rbxcompose.domains.body.urdf import body_of
from rbxcompose.msgs.moveit_msgs import ApplyPlanningScene, AttachedCollisionObject, CollisionObject, GetPlanningScene
from rbxcompose.msgs.moveit_msgs import PlanningScene as PlanningSceneMessage
from rbxcompose.msgs.rbxcompose_msgs import AttachObject, DetachObject, SceneObjects
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.visualization_msgs import MarkerArray
from rbxcompose.sdk import Component, Config, In, Looks, Out, Port, Refused, Serves, answers, component
from rbxcompose.sdk.bound import KeyFeed, whole
from rbxcompose.sdk.component import RECALLED_WITHIN

ROUNDING = 1e-6  # of a period
PERIOD = 0.1  # [s] after which it is looked where frames outside of the body are
PATIENCE = 2.0  # [s] in which frames become known after the start
MOMENT = 0.05  # [s] between messages of a scene that programs change
MOVED, TURNED = 1e-3, 2e-3  # [m], [rad] by which a frame may be elsewhere than where it was published


class ShapeConfig(Config):
    """A shape of a thing."""

    kind: str
    """`box`, `cylinder`, `cone`, `sphere`, `plane`, `mesh` or `octree`."""
    size: tuple[float, ...]
    """Lengths [m]: sides, or radius and length; a, b, c and d of a plane; scale of a mesh; side of a cell."""
    file: str = ""
    """File of a mesh or an octree."""
    points: tuple[float, ...] = ()
    """Corners of a mesh without a file, or middles of cells: x, y and z of each."""
    triangles: tuple[int, ...] = ()
    """Three of the corners each."""
    position: Vector3 = (0.0, 0.0, 0.0)
    """Where its middle is in the frame of the thing."""
    rotation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    """How it is turned: a quaternion x, y, z, w."""


class ObjectConfig(Config):
    """A thing in the frame of a link; lengths in [m]."""

    link: str
    """The link that it moves with, or a frame outside of the body."""
    position: Vector3 = (0.0, 0.0, 0.0)
    """Where it is."""
    rotation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    """How it is turned: a quaternion x, y, z, w."""
    shapes: tuple[ShapeConfig, ...] = Field(min_length=1)
    """Its shapes."""
    touches: tuple[str, ...] = ()
    """Links that it may touch."""
    touches_objects: tuple[str, ...] = ()
    """Things that it may touch."""
    padding: float = 0.0
    """How far all else keeps from it."""
    colour: Colour | None = None
    """Red, green, blue and opacity, from 0 to 1."""


class SceneConfig(Config):
    """The body, and the things that are there from the start."""

    urdf: str
    """Text of the URDF of the body."""
    objects: dict[str, ObjectConfig] = Field(default_factory=dict)
    """Things by name."""
    frames: tuple[str, ...] = ()
    """Frames outside of the body in which things may stand."""
    paddings: dict[str, float] = Field(default_factory=dict)
    """How far links keep away from things [m]."""
    clouds: tuple[str, ...] = ()
    """Things that sensors see."""


@component("scene")
class Scene(Component[SceneConfig]):
    """Keeps the planning scene, and publishes it whenever it changes; `rbxcompose scene` changes it.

    Things in frames outside of the body, such as `map`, are published where they are as seen from the body, again
    whenever it has moved.

    Example:
        things: {type: scene, urdf: '<robot name="cart"><link name="base"/></robot>'}
    """

    made_by = "A robot with arms runs one."
    process = "scene"
    blocking = True  # an octree may take a second to read
    joint_states = In(JointState, "joint_states", is_open=True)
    collision_object = In(CollisionObject, "collision_object", qos="event", is_open=True, limits=SCENE_LIMITS)
    attached_collision_object = In(
        AttachedCollisionObject, "attached_collision_object", qos="event", is_open=True, limits=SCENE_LIMITS
    )
    planning_scene = In(PlanningSceneMessage, "planning_scene", qos="event", is_open=True, limits=SCENE_LIMITS)
    apply_planning_scene = Serves(ApplyPlanningScene, "apply_planning_scene", skill=None, limits=SCENE_LIMITS)
    get_planning_scene = Serves(GetPlanningScene, "get_planning_scene", skill=None)
    scene = Out(SceneObjects, "scene", qos="latched")
    markers = Out(MarkerArray, "scene_markers", qos="latched")

    @classmethod
    def ports(cls, config: SceneConfig) -> dict[str, Port[Any]]:
        """Return the ports: its own, what sensors see, and a look at each frame outside of the body."""
        root = body_of(config.urdf).root
        found: dict[str, Port[Any]] = {
            f"cloud_{item}": In(SceneObjects, f"scene/{item}", qos="latched", limits=SCENE_LIMITS)
            for item in config.clouds
        }
        found |= {_look(frame): Looks(source=frame, target=root) for frame in config.frames}
        return super().ports(config) | {name: port.named(name) for name, port in found.items()}

    attach_object = Serves(AttachObject, "scene/attach")
    detach_object = Serves(DetachObject, "scene/detach")

    def configure(self) -> None:
        """Read the body and put the objects into the scene."""
        self.positions: dict[str, float] = {}
        self.outside: dict[
            str, Transform3
        ] = {}  # frames outside of the body in that of its root, as they were published
        objects = (_placed(name, object_) for name, object_ in self.config.objects.items())
        self.things = PlanningScene(body_of(self.config.urdf), objects, self.config.frames)
        self.moveit = MoveItScene(self.things, dict(self.config.paddings))
        self.initial = dict(self.things.objects)
        self.kept: scene_view.RecallScene | None = None  # what the supervisor keeps
        self.knows_from = math.inf if self.context.is_again else -math.inf  # [s] when what was kept has come

    def activate(self) -> None:
        """Publish it, as soon as frames are known."""
        self.is_told, self.began = False, self.now
        self.seen = scene_view.scene_parts((), "nothing is known yet")
        self.feed = KeyFeed(self.context.window(scene_view.SCENE_WINDOW, scene_view.LookAtScene()))
        self.published = -MOMENT
        self.publish()
        self.wake()

    def start(self) -> None:
        """Publish nothing until the scene from before a restart has come."""
        if self.now < self.knows_from:
            self.knows_from = self.now + RECALLED_WITHIN
            self.context.wake_at(self.knows_from)

    @answers(scene_view.RecallScene)
    def recall(self, request: scene_view.RecallScene) -> str:
        """Go on with the scene from before a restart, and with what has changed since."""
        since = {name: thing for name, thing in self.things.objects.items() if self.initial.get(name) is not thing}
        self.things.objects = {thing.name: thing for thing in request.objects} | since
        self.things.stood_in, self.moveit.paddings = dict(request.stood_in), dict(request.paddings)
        self.knows_from = -math.inf
        self.publish()
        return "the scene is as it was before the restart"

    def keep(self) -> None:
        """Let the supervisor keep the scene for a restart, if it has changed; cells that sensors see come again."""
        things = self.things.objects.values()
        kept = tuple(thing for thing in things if thing.shape.kind != OCTREE or thing.shape.file)
        news = scene_view.RecallScene(kept, dict(self.things.stood_in), dict(self.moveit.paddings))
        if news != self.kept:
            self.kept = news
            self.context.repeat([news])

    def on_joint_states(self, message: JointState) -> None:
        """Note where joints are."""
        self.positions.update(zip(message.name, message.position.tolist(), strict=False))

    def on_collision_object(self, message: CollisionObject) -> None:
        """Change an object of the world."""
        self.attempt(f"object '{message.id}'", lambda: self.moveit.change(message))

    def on_attached_collision_object(self, message: AttachedCollisionObject) -> None:
        """Attach or detach an object."""
        self.attempt(f"object '{message.object.id}'", lambda: self.moveit.attach(message, self.poses))

    def on_planning_scene(self, message: PlanningSceneMessage) -> None:
        """Change the scene."""
        self.attempt("a planning scene", lambda: self.moveit.apply(message, self.poses))

    def on_apply_planning_scene(self, request: ApplyPlanningScene.Request) -> ApplyPlanningScene.Response:
        """Change the scene and report whether that could be."""
        is_done = self.attempt("a planning scene", lambda: self.moveit.apply(request.scene, self.poses))
        return ApplyPlanningScene.Response(success=is_done)

    def on_get_planning_scene(self, request: GetPlanningScene.Request) -> GetPlanningScene.Response:
        """Tell the scene, whatever components of it are asked for."""
        return GetPlanningScene.Response(scene=self.moveit.message(self.name, self.positions))

    def received(self, port: str, message: SceneObjects) -> None:
        """Put what a sensor sees into the scene; a thing without shapes is gone."""
        for object_ in message.objects:
            if object_.shapes:
                self.attempt(f"what '{object_.name}' is", partial(self.things.put, placed_object(object_)))
            elif object_.name in self.things.objects:
                self.attempt(f"the end of '{object_.name}'", partial(self.things.remove, object_.name))

    def attempt(self, what: str, how: Callable[[], None]) -> bool:
        """Change the scene as a message asks; return whether that could be, and log why not.

        Programs send many objects one by one: all that come within a moment are published together.
        """
        try:
            self.change(how, is_patient=True)
        except Refused as refusal:
            self.warn(f"{plain(what)} is refused: {plain(str(refusal))}")
            return False
        return True

    def wake(self) -> None:
        """Publish again if the body has moved in a frame in which something stands."""
        if self.config.frames:  # on a grid, so that wakes for other reasons do not multiply these
            self.context.wake_at(PERIOD * (math.floor(self.now / PERIOD + ROUNDING) + 1))
        used = {object_.link for object_ in self.things.objects.values()}
        here = self.looked()
        if not self.is_told or any(
            frame in used and _differs(self.outside.get(frame), here.get(frame)) for frame in self.config.frames
        ):
            self.publish()

    def looked(self) -> dict[str, Transform3]:
        """Return the frames outside of the body that have a pose in its root."""
        found = {}
        for frame in self.config.frames:
            try:
                found[frame] = self.bound[_look(frame)].transform()
            except LookupError:
                continue  # who needs it reports that
        return found

    @property
    def poses(self) -> dict[str, Transform3]:
        """Return where all links and frames are."""
        return self.things.body.poses(self.positions) | self.looked()

    @answers(scene_view.LookAtScene)
    def look(self, request: scene_view.LookAtScene) -> Mapping[str, Any]:
        """Return what viewers see."""
        return whole(self.seen)

    @answers(scene_view.ListScene)
    def listed(self, request: scene_view.ListScene) -> tuple[PlacedObject, ...]:
        """Return all objects; points of meshes and octrees are too many to be listed."""
        return tuple(_without_points(object_) for object_ in self.things.objects.values())

    @answers(scene_view.StandingObjects)
    def standing(self, request: scene_view.StandingObjects) -> tuple[PlacedObject, ...]:
        """Return the objects around the robot."""
        try:
            found = self.things.on_body(self.looked())
        except SceneError as error:
            raise Refused(str(error)) from None
        return tuple(object_ for object_ in found if object_.link == self.things.body.root)

    def on_attach_object(self, request: AttachObject.Request) -> AttachObject.Response:
        """Let an object move with a link."""
        wanted = scene_view.AttachInScene(request.object, request.link, request.touches)
        return AttachObject.Response(**_outcome(lambda: self.attach(wanted)))

    def on_detach_object(self, request: DetachObject.Request) -> DetachObject.Response:
        """Let an object stay where it is."""
        return DetachObject.Response(**_outcome(lambda: self.detach(scene_view.DetachInScene(request.object))))

    @answers(scene_view.AddToScene)
    def add(self, request: scene_view.AddToScene) -> str:
        """Put an object into the scene."""
        object_ = replace(request.entry, link=request.entry.link or self.things.body.root)
        self.change(lambda: self.things.add(object_))
        return f"'{object_.name}' is in the scene, in the frame of '{object_.link}'"

    @answers(scene_view.LoadScene)
    def load(self, request: scene_view.LoadScene) -> str:
        """Put the objects of a text into the scene, all or none."""
        read = read_scene(request.text, request.file)
        if isinstance(read, Finding):
            raise Refused(f"{read.span}: {read.message}")
        link = request.link or self.things.body.root

        def change() -> None:
            for object_ in read.objects:
                self.things.put(replace(object_, link=link))

        self.change(change)
        return f"{len(read.objects)} objects are in the scene, in the frame of '{link}'"

    @answers(scene_view.RemoveFromScene)
    def remove(self, request: scene_view.RemoveFromScene) -> str:
        """Take an object out of the scene."""
        self.change(lambda: self.things.remove(request.object))
        return f"'{request.object}' is gone"

    @answers(scene_view.AttachInScene)
    def attach(self, request: scene_view.AttachInScene) -> str:
        """Let an object move with a link."""
        self.change(lambda: self.things.attach(request.object, request.link, request.touches, self.poses))
        return f"'{request.object}' moves with '{request.link}'"

    @answers(scene_view.DetachInScene)
    def detach(self, request: scene_view.DetachInScene) -> str:
        """Let an object stay where it is."""
        self.change(lambda: self.things.detach(request.object, self.poses))
        return f"'{request.object}' stays where it is"

    def change(self, how: Callable[[], None], *, is_patient: bool = False) -> None:
        """Change the scene and publish it, or leave it as it is.

        Raises:
            Refused: if the change cannot be.
        """
        objects, paddings = dict(self.things.objects), dict(self.moveit.paddings)
        try:
            how()
        except SceneError as error:
            self.things.objects, self.moveit.paddings = objects, paddings
            raise Refused(str(error)) from None
        if is_patient and self.now - self.published < MOMENT:
            self.is_told = False
            self.context.wake_at(self.published + MOMENT)
        else:
            self.publish()

    def publish(self) -> None:
        """Publish all objects where they are as seen from the body."""
        if self.now < self.knows_from:
            return
        self.keep()
        self.outside, problem = self.looked(), ""
        found: tuple[PlacedObject, ...] = ()
        try:
            found = self.things.on_body(self.outside)
        except SceneError as error:
            problem = str(error)
        if problem and not self.is_told and self.now - self.began < PATIENCE:
            return
        self.is_told, self.published = True, self.now
        self.seen = scene_view.scene_parts(found, problem)
        self.feed.update(self.seen)
        try:
            self.markers(markers(found))
        except ValueError as error:
            problem = str(error)
        self.scene(
            SceneObjects(
                objects=tuple(map(object_message, found)),
                problem=problem,
                padded_links=tuple(self.moveit.paddings),
                paddings=np.array([*self.moveit.paddings.values()], dtype=np.float64),
            )
        )


def _without_points(object_: PlacedObject) -> PlacedObject:
    pieces = [replace(each, shape=replace(each.shape, points=(), triangles=())) for each in object_.own_pieces]
    return replace(object_, shape=pieces[0].shape, pieces=tuple(pieces[1:]))


def _outcome(change: Callable[[], str]) -> dict[str, Any]:
    """Return the fields of a response: whether a change was done, and its words."""
    try:
        return {"success": True, "message": change()}
    except Refused as refusal:
        return {"success": False, "message": str(refusal)}


def _look(frame: str) -> str:
    return f"in_{frame}"


def _differs(before: Transform3 | None, now: Transform3 | None) -> bool:
    if before is None or now is None:
        return before is not now
    moved = max(abs(value - other) for value, other in zip(before.translation, now.translation, strict=True))
    return moved > MOVED or angle_between(before.rotation, now.rotation) > TURNED


def _placed(name: str, config: ObjectConfig) -> PlacedObject:
    pieces = [
        ScenePiece(
            Geometry(each.kind, each.size, each.file, each.points, each.triangles),
            Transform3(each.position, each.rotation),
        )
        for each in config.shapes
    ]
    more = {key: getattr(config, key) for key in ("touches", "touches_objects", "colour", "padding")}
    return PlacedObject.of(name, config.link, Transform3(config.position, config.rotation), pieces, **more)
