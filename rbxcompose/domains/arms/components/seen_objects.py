"""Puts what a camera sees into the planning scene.

Its core decides which sighting is of which object, and which object is gone. Poses are in one frame that does not move
with the camera, lengths in [m], times are robot time [s].
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import replace

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, Vector3, angle_between
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain
from rbxcompose.domains.arms.motion.scene import SCENE_LIMITS
from rbxcompose.msgs.moveit_msgs import CollisionObject
from rbxcompose.msgs.poses import pose_message, pose_of
from rbxcompose.msgs.rbxcompose_msgs import SceneObjects
from rbxcompose.msgs.shape_msgs import SolidPrimitive
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.vision_msgs import Detection3D, Detection3DArray

MOST_OBJECTS = 200
"""More are no table with things, but noise."""
TURNED = math.radians(5)  # [rad] by which an object is turned if it is published anew


@dataclass(frozen=True, slots=True)
class Sighting:
    """A box around a thing: what it seems to be, the id of a tracker if there is one, its sides and its middle."""

    label: str
    id: str
    size: Vector3
    pose: Transform3


@dataclass(frozen=True, slots=True)
class SeenObject:
    """An object as it was published, and when it was last seen."""

    name: str
    sighting: Sighting
    at: float


class Sightings:
    """Gives sightings the names of objects."""

    def __init__(self, near: float, still: float, forget: float) -> None:
        """Take sightings up to `near` apart for the same thing, and report one that is more than `still` elsewhere.

        What was not seen for `forget` is gone.
        """
        self._near, self._still, self._forget = near, still, forget
        self.objects: dict[str, SeenObject] = {}

    def take(self, now: float, found: Iterable[Sighting], held: Collection[str]) -> list[SeenObject]:
        """Return the objects that are new, or no longer as published; those that are `held` stay as they are."""
        changed, free = list[SeenObject](), {name for name in self.objects if name not in held}
        for sighting in found:
            name = sighting.id or self._nearest(sighting, free) or self._fresh(sighting.label or "object")
            before = self.objects.get(name)
            if name in held or (before is None and len(self.objects) >= MOST_OBJECTS):
                continue
            free.discard(name)
            is_same = before is not None and not self._differs(before.sighting, sighting)
            self.objects[name] = replace(before, at=now) if before and is_same else SeenObject(name, sighting, now)
            if not is_same:
                changed.append(self.objects[name])
        return changed

    def forgotten(self, now: float, held: Collection[str]) -> list[str]:
        """Forget what was not seen for long, and return its names; what is held is known to be there."""
        for name in held:
            if name in self.objects:
                self.objects[name] = replace(self.objects[name], at=now)
        gone = [seen.name for seen in self.objects.values() if now - seen.at > self._forget]
        for name in gone:
            del self.objects[name]
        return gone

    def put(self, name: str, pose: Transform3 | None) -> None:
        """Know that somebody has put an object elsewhere; None if it is not known where, so that it is seen anew."""
        if (seen := self.objects.pop(name, None)) is not None and pose is not None:
            self.objects[name] = replace(seen, sighting=replace(seen.sighting, pose=pose))

    def nearest(self, point: Vector3, held: Collection[str]) -> str:
        """Return the name of the object whose middle is nearest to a point, of those seen; nothing without any."""
        free = [seen for seen in self.objects.values() if seen.name not in held]
        return min(free, key=lambda seen: math.dist(seen.sighting.pose.translation, point)).name if free else ""

    def newest(self, held: Collection[str]) -> str:
        """Return the name of the object that was seen last; of several the one that is new; nothing without any."""
        free = [seen for seen in self.objects.values() if seen.name not in held]
        return max(reversed(free), key=lambda seen: seen.at).name if free else ""

    def _nearest(self, sighting: Sighting, free: Collection[str]) -> str:
        """Return the object that a sighting without an id is of; nothing if none of them is near."""
        alike = [
            (away, other.name)
            for other in self.objects.values()
            if other.name in free and not other.sighting.id and other.sighting.label == sighting.label
            if (away := math.dist(other.sighting.pose.translation, sighting.pose.translation)) <= self._near
        ]
        return min(alike)[1] if alike else ""

    def _fresh(self, label: str) -> str:
        return next(name for n in range(1, MOST_OBJECTS + 2) if (name := f"{label}_{n}") not in self.objects)

    def _differs(self, before: Sighting, now: Sighting) -> bool:
        moved = math.dist(before.pose.translation, now.pose.translation)
        grown = max(abs(value - other) for value, other in zip(before.size, now.size, strict=True))
        return max(moved, grown) > self._still or angle_between(before.pose.rotation, now.pose.rotation) > TURNED


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
