"""Puts what a camera sees into the planning scene."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import Transform3
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain
from rbxcompose.domains.arms.motion.scene import SCENE_LIMITS
from rbxcompose.domains.arms.motion.sightings import SeenObject, Sighting, Sightings
from rbxcompose.msgs.moveit_msgs import CollisionObject
from rbxcompose.msgs.poses import pose_message, pose_of
from rbxcompose.msgs.rbxcompose_msgs import SceneObjects
from rbxcompose.msgs.shape_msgs import SolidPrimitive
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.vision_msgs import Detection3D, Detection3DArray

DETECTIONS, LOOK = "detections", "look"  # ports that depend on the configuration
SMALLEST, LARGEST = 1e-3, 10.0  # [m] of a side
CYLINDER = "cylinder"  # the class of what stands upright in its box, and is round
ROUND = 1.02  # times as wide as deep the box of that may be
AT_ORIGIN = (0.0, 0.0, 0.0)


class SeenObjectsConfig(sdk.Config):
    """Where detections come from, and when they are of the same thing."""

    topic: str = Field("detections", min_length=1)
    """Where detections come from: `vision_msgs/Detection3DArray`."""
    frame: str = Field(min_length=1)
    """The frame in which they are: the optical frame of the camera."""
    stands_in: str = Field(min_length=1)
    """The frame in which things stay where they are while the camera turns: the root of the body, or `odom`."""
    score: float = Field(0.5, ge=0, le=1)
    """How sure a detection must be; one without a score counts."""
    near: sdk.Length = Field(0.1, gt=0)
    """Detections of the same class so near to each other are of the same thing, unless a tracker gives them ids."""
    still: sdk.Length = Field(0.005, ge=0)
    """By how much a thing must be elsewhere until the scene is updated."""
    forget: sdk.Time = Field(30.0, gt=0)
    """What was not seen for so long is gone: longer than an arm that reaches for a thing hides it."""


@sdk.component("seen_objects")
class SeenObjects(sdk.Component[SeenObjectsConfig]):
    """Puts boxes that a camera sees into the planning scene, moves them there, and takes them out when they are gone.

    A box of the class `cylinder` whose x and y are alike is one about its z.

    An object has the id of its detection, else the class and a number: `cup_1`. The topics `nearest_object`, to
    the camera, and `newest_object` have the name of one for missions: `pick_arm: $seen`. What an arm holds is left
    alone.

    Example:
        seeing: {type: seen_objects, frame: camera_depth_optical_frame, stands_in: base_link}
    """

    rate = 5.0
    scene = sdk.In(SceneObjects, "scene", qos="latched", is_open=True, limits=SCENE_LIMITS)
    objects = sdk.Out(CollisionObject, "collision_object", qos="event")
    nearest = sdk.Out(String, "nearest_object")
    newest = sdk.Out(String, "newest_object")

    @classmethod
    def ports(cls, config: SeenObjectsConfig) -> dict[str, sdk.Port[object]]:
        """Return the ports: its own, the detections, and where the camera is."""
        detections = sdk.In(Detection3DArray, config.topic, is_open=True, may_be_silent=True).named(DETECTIONS)
        return super().ports(config) | {
            DETECTIONS: detections,
            LOOK: sdk.Looks(source=config.frame, target=config.stands_in).named(LOOK),
        }

    @classmethod
    def capabilities(cls, config: SeenObjectsConfig) -> tuple[sdk.Capability, ...]:
        """Declare where things stand."""
        return (sdk.PutsThings(sdk.Setting(config.stands_in, "stands_in")),)

    def configure(self) -> None:
        """Know nothing yet."""
        self.core = Sightings(self.config.near, self.config.still, self.config.forget)
        self.held: frozenset[str] = frozenset()
        self.problem, self.camera = "", AT_ORIGIN

    def on_scene(self, message: SceneObjects) -> None:
        """Note what is held, which is what may touch links, and where an arm has put things."""
        known, before = self.core.objects, self.held
        self.held = frozenset(object_.name for object_ in message.objects if object_.name in known and object_.touches)
        for thing in message.objects:
            if thing.name in before - self.held:
                self.core.put(thing.name, pose_of(thing.pose) if thing.link == self.config.stands_in else None)

    def on_detections(self, message: Detection3DArray) -> None:
        """Publish to the scene what is new or has moved."""
        frame, sent = message.header.frame_id, to_nanoseconds(message.header.stamp)
        if frame not in ("", self.config.frame):
            self.complain(f"detections are in '{plain(frame)}', and expected in '{self.config.frame}'")
            return
        try:
            at: Transform3 = self.bound[LOOK].transform(at=sent or None)
        except LookupError as error:
            self.complain(f"detections are left out: {error}")
            return
        self.problem, self.camera = "", at.translation
        found = [self.sighting(detection, at) for detection in message.detections]
        for each in self.core.take(self.now, [sighting for sighting in found if sighting is not None], self.held):
            self.objects(added(each, self.config.stands_in))
        self.publish_names()

    def sighting(self, one: Detection3D, camera: Transform3) -> Sighting | None:
        """Return what was seen; None if it is no box, or not sure enough."""
        best = max(one.results, key=lambda each: each.hypothesis.score, default=None)
        size, pose = (one.bbox.size.x, one.bbox.size.y, one.bbox.size.z), pose_of(one.bbox.center)
        is_box = all(SMALLEST <= side <= LARGEST for side in size) and all(map(math.isfinite, pose.translation))
        if not is_box or abs(math.hypot(*pose.rotation) - 1.0) > 1e-2:
            self.complain(f"a detection is no box of {SMALLEST * 1e3:g} mm to {LARGEST:g} m")
            return None
        if best is not None and best.hypothesis.score < self.config.score:
            return None
        label = plain(best.hypothesis.class_id) if best is not None else ""
        return Sighting(label, plain(one.id), size, camera.compose(pose))

    def complain(self, problem: str) -> None:
        """Log what is wrong, once."""
        if problem != self.problem:
            self.problem = problem
            self.warn(problem)

    def step(self, dt: float) -> None:
        """Take out what was not seen for long."""
        for name in self.core.forgotten(self.now, self.held):
            self.info(f"'{name}' was not seen for {self.config.forget:g} s")
            self.objects(CollisionObject(id=name, operation=CollisionObject.REMOVE))
        self.publish_names()
        known = ", ".join(self.core.objects) or "nothing"
        self.status(Level.WARN if self.problem else Level.OK, self.problem or f"sees {known}")

    def publish_names(self) -> None:
        """Publish the names that missions want."""
        self.nearest(String(data=self.core.nearest(self.camera, self.held)))
        self.newest(String(data=self.core.newest(self.held)))


def added(seen: SeenObject, frame: str) -> CollisionObject:
    """Return an object as MoveIt's scene takes it."""
    x, y, z = seen.sighting.size
    is_round = seen.sighting.label == CYLINDER and max(x, y) <= ROUND * min(x, y)
    kind = SolidPrimitive.CYLINDER if is_round else SolidPrimitive.BOX
    return CollisionObject(
        header=Header(frame_id=frame),
        id=seen.name,
        pose=pose_message(seen.sighting.pose),
        primitives=(SolidPrimitive(type=kind, dimensions=np.array((z, x / 2) if is_round else (x, y, z))),),
        operation=CollisionObject.ADD,
    )
