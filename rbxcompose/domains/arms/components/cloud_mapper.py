"""What a sensor of distances sees, as a thing that arms plan around: which points are new, which cells are occupied."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import Array, Bools, Ints, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.collisions import Shapes, readers_of
from rbxcompose.domains.arms.motion.scene import OCTREE, PLANE, SCENE_LIMITS, PlacedObject, mistake_among
from rbxcompose.domains.arms.motion.scene_messages import object_message, placed_object
from rbxcompose.domains.body.model import Body, Geometry
from rbxcompose.domains.body.urdf import body_of
from rbxcompose.domains.worlds.physics.solids import apply, rotation_matrix
from rbxcompose.msgs.rbxcompose_msgs import SceneObject, SceneObjects
from rbxcompose.msgs.sensor_arrays import CloudError, points_of
from rbxcompose.msgs.sensor_msgs import JointState, PointCloud2
from rbxcompose.msgs.stamps import NANOSECONDS, to_nanoseconds
from rbxcompose.sdk.updater import TaskStatus

_BITS = 21  # of the number of a cell along each axis
_HALF, _MASK = 1 << (_BITS - 1), (1 << _BITS) - 1


class SeenCells:
    """Cells with sides of `side` [m]; each is forgotten `forget` [s] after it was seen last."""

    def __init__(self, side: float, forget: float) -> None:
        self.side, self.forget = side, forget
        self._keys: Ints = np.empty(0, dtype=np.int64)  # sorted
        self._seen: Array = np.empty(0)

    def __len__(self) -> int:
        return len(self._keys)

    def found(self, points: Array, least: int = 1) -> Array:
        """Return the middles of the cells with at least so many of the points, of shape (n, 3); all in [m]."""
        keys, counts = np.unique(self._key(points), return_counts=True)
        return self._middles(keys[counts >= least])

    def see(self, middles: Array, now: float) -> bool:
        """Note that cells are seen at a time [s], and forget old ones; return whether others are there than before."""
        new, before = np.unique(self._key(middles)), self._keys
        is_kept = (self._seen > now - self.forget) & (self._seen <= now) & ~np.isin(before, new, assume_unique=True)
        keys = np.concatenate((before[is_kept], new))
        order = np.argsort(keys)
        self._keys = keys[order]
        self._seen = np.concatenate((self._seen[is_kept], np.full(len(new), now)))[order]
        return not np.array_equal(before, self._keys)

    def middles(self) -> Array:
        """Return the middles of all cells [m], of shape (n, 3)."""
        return self._middles(self._keys)

    def _key(self, points: Array) -> Ints:
        cells = np.floor(points / self.side).astype(np.int64) + _HALF
        cells = cells[np.all((cells >= 0) & (cells <= _MASK), axis=1)]
        return np.asarray(cells[:, 0] << 2 * _BITS | cells[:, 1] << _BITS | cells[:, 2])

    def _middles(self, keys: Ints) -> Array:
        cells = np.stack([keys >> 2 * _BITS, keys >> _BITS & _MASK, keys & _MASK], axis=1)
        return (cells - _HALF + 0.5) * self.side


@dataclass(frozen=True, slots=True)
class FilledSpace:
    """A shape that moves with a link, at a pose in its frame; of a mesh the box around it, from `low` to `high`."""

    link: str
    shape: Geometry
    pose: Transform3
    low: Array
    high: Array


class SpaceFilter:
    """Tells points that are within the collision shapes of a body, or of objects."""

    def __init__(self, body: Body, meshes: Mapping[str, Path] = MappingProxyType({})) -> None:
        """Measure the shapes of a body.

        Raises:
            ModuleNotFoundError: without the extra `arm`.
            ValueError: if a mesh cannot be read.
        """
        self._shapes = Shapes(meshes)
        self._objects: tuple[FilledSpace, ...] = ()
        self._body = tuple(
            self._space(link.name, shape.geometry, shape.origin)
            for link in body.links.values()
            for shape in link.collisions
        )

    def place(self, objects: Iterable[PlacedObject]) -> None:
        """Tell points within these objects, too; an octree is none of them: it is made of points."""
        self._objects = tuple(self._of_objects(objects))

    def within(self, points: Array, poses: Mapping[str, Transform3], padding: float) -> Bools:
        """Return which points, of shape (n, 3) in the root's frame, are less than `padding` [m] from a shape.

        `poses` are those of links in the root's frame.
        """
        found = np.zeros(len(points), dtype=bool)
        for space in (*self._body, *self._objects):
            found |= _within(space, points, poses[space.link].compose(space.pose), padding)
        return found

    def _of_objects(self, objects: Iterable[PlacedObject]) -> Iterator[FilledSpace]:
        for thing in objects:
            for piece in thing.all_pieces:
                if piece.shape.kind != OCTREE:
                    yield self._space(thing.link, piece.shape, piece.pose)

    def _space(self, link: str, shape: Geometry, pose: Transform3) -> FilledSpace:
        if shape.kind == PLANE:
            return FilledSpace(link, shape, pose, np.zeros(3), np.zeros(3))
        coal = self._shapes.of(shape)
        coal.computeLocalAABB()
        box = coal.aabb_local
        return FilledSpace(link, shape, pose, np.array(box.min_), np.array(box.max_))


def _within(space: FilledSpace, points: Array, pose: Transform3, padding: float) -> Bools:
    own = (points - pose.translation) @ rotation_matrix(pose.rotation)  # in the frame of the shape
    if space.shape.kind == PLANE:
        *normal, offset = space.shape.size
        return np.asarray(own @ normal + offset <= padding)
    inside: Bools = np.all((own >= space.low - padding) & (own <= space.high + padding), axis=1)
    if space.shape.kind == "sphere":
        inside &= np.einsum("ij,ij->i", own, own) <= (space.shape.size[0] + padding) ** 2
    elif space.shape.kind in ("cylinder", "cone", "capsule"):
        inside &= own[:, 0] ** 2 + own[:, 1] ** 2 <= (space.shape.size[0] + padding) ** 2
    return inside


CLOUD = "cloud"  # the port
OLDEST, EARLIEST = 1.0, 0.2  # [s] by which the stamp of a cloud may be behind and ahead of now
MOST_CELLS = 50_000  # of an octree; more would make each examination of a motion slow
KNOWN = 200  # messages about joints that are remembered
SOON = 1e-3  # [s]


class CloudMapperConfig(sdk.Config):
    """Which clouds, and what is made of them; lengths in [m], times in [s]."""

    name: str
    """Name of the thing in the scene."""
    topic: str
    """The topic of the clouds."""
    urdf: str
    """Text of the URDF of the body."""
    meshes: dict[str, str] = {}
    """Files of meshes by their names in the URDF."""
    range: sdk.Length = Field(1.5, gt=0)
    """How far from the sensor points count."""
    nearest: sdk.Length = Field(0.0, ge=0)
    """Nearer points do not count."""
    cell: sdk.Length = Field(0.02, ge=0.005, le=0.5)
    """Side of a cell of the octree."""
    least: int = Field(1, ge=1)
    """How many points of one cloud a cell must have."""
    padding: sdk.Length = Field(0.03, ge=0)
    """Points nearer to the robot or to known things are taken for these."""
    forget: float = Field(5.0, gt=0)
    """How long a cell stays in which clouds show nothing any more."""
    rate: float = Field(2.0, gt=0, le=30)
    """How many clouds a second are used [Hz]."""
    frame: str = ""
    """The frame in which cells stay where they are; without it the root of the body."""
    frames: tuple[str, ...] = ()
    """Frames outside of the body in which clouds may be."""


@sdk.component("cloud_mapper")
class CloudMapper(sdk.Component[CloudMapperConfig]):
    """Turns clouds of points into an octree of the planning scene, without the robot itself and things that are known.

    Example:
        camera: {type: cloud_mapper, name: camera, topic: points, urdf: '<robot name="a"><link name="base"/></robot>'}
    """

    made_by = "Each entry of `scene: {clouds: ...}` runs one."
    process = "clouds"
    blocking = True
    joint_states = sdk.In(JointState, "joint_states", is_open=True)
    scene = sdk.In(SceneObjects, "scene", qos="latched", limits=SCENE_LIMITS)

    @classmethod
    def ports(cls, config: CloudMapperConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports: clouds, the octree, and a look at each frame outside of the body."""
        root = body_of(config.urdf).root
        found: dict[str, sdk.Port[Any]] = {
            CLOUD: sdk.In(PointCloud2, config.topic, qos="bulk", is_open=True, max_rate=max(1.0, 2 * config.rate)),
            "cells": sdk.Out(SceneObjects, f"scene/{config.name}", qos="latched"),
            **{_look(frame): sdk.Looks(source=frame, target=root) for frame in _outside(config)},
        }
        return super().ports(config) | {name: port.named(name) for name, port in found.items()}

    @classmethod
    def capabilities(cls, config: CloudMapperConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it imports."""
        needed = ("coal", *readers_of(config.meshes.values()))
        return tuple(sdk.NeedsExtra(sdk.Setting(module), sdk.Setting("arm")) for module in needed)

    def configure(self) -> None:
        """Measure the body."""
        config = self.config
        self.body = body_of(config.urdf)
        self.filter = SpaceFilter(self.body, {name: Path(path) for name, path in config.meshes.items()})
        self.seen = SeenCells(config.cell, config.forget)
        self.joints: deque[tuple[int, dict[str, float]]] = deque(maxlen=KNOWN)  # with stamps [ns]
        self.used_at, self.received_at = -np.inf, -np.inf
        self.problem, self.last_summary = "", "nothing has come yet"
        self.add_diagnostic("clouds", self.health)

    def on_joint_states(self, message: JointState) -> None:
        """Note where joints are."""
        before = self.joints[-1][1] if self.joints else {}
        stamp = to_nanoseconds(message.header.stamp) or self.stamp
        self.joints.append((stamp, {**before, **dict(zip(message.name, message.position.tolist(), strict=False))}))

    def on_scene(self, message: SceneObjects) -> None:
        """Leave out points of things that are known from now on."""
        found = map(placed_object, message.objects)
        there = [object_ for object_ in found if object_.name != self.config.name and object_.link in self.body.links]
        try:
            if mistake := mistake_among(there, self.body):
                raise ValueError(mistake)
            self.filter.place(there)
        except ValueError as error:
            self.warn(f"points of things that are known are not left out: {error}")

    def received(self, port: str, message: PointCloud2) -> None:
        """Use a cloud, if it is time for one."""
        if port != CLOUD or self.now - self.used_at < 1.0 / self.config.rate - SOON:
            return
        self.used_at = self.now
        try:
            count = self.use(message)
        except (CloudError, LookupError) as error:
            self.note_problem(f"a cloud is not used: {error}")
            return
        self.received_at = self.now
        self.last_summary = f"{count:,} points, {len(self.seen):,} cells"
        self.note_problem(
            f"{len(self.seen):,} cells, and {MOST_CELLS:,} may be: use larger ones" if self.is_crowded else ""
        )

    @property
    def is_crowded(self) -> bool:
        """Return whether there are too many cells."""
        return len(self.seen) > MOST_CELLS

    def note_problem(self, problem: str) -> None:
        """Log a problem once, and its end."""
        if problem and not self.problem:
            self.warn(problem)
        elif self.problem and not problem:
            self.info(f"clouds are used again: {self.last_summary}")
        self.problem = problem

    def health(self, now: float) -> TaskStatus:
        """Return how it stands."""
        silence = now - self.received_at
        problem = self.problem
        if not problem and silence > max(2.0 / self.config.rate, OLDEST):
            problem = (
                f"no cloud for {silence:.0f} s: what was seen last stays"
                if self.received_at >= 0
                else self.last_summary
            )
        return TaskStatus(sdk.Level.WARN if problem else sdk.Level.OK, problem or self.last_summary)

    def use(self, message: PointCloud2) -> int:
        """See what a cloud shows, and publish it to the scene; return how many points counted.

        Raises:
            CloudError: if it cannot be used.
            LookupError: if its frame has no transform at its time.
        """
        points = points_of(message)
        stamp = to_nanoseconds(message.header.stamp) or self.stamp
        age = (self.stamp - stamp) / NANOSECONDS
        if not -EARLIEST <= age <= OLDEST:
            raise CloudError(f"its stamp is {abs(age):.1f} s {'old' if age > 0 else 'in the future'}")
        poses = self.body.poses(self.joints_at(stamp))
        sensor = self.pose_of(message.header.frame_id, poses, stamp)
        away = np.einsum("ij,ij->i", points, points)
        points = points[(away <= self.config.range**2) & (away >= self.config.nearest**2)]
        kept = self.pose_of(self.config.frame, poses, stamp)
        middles = self.seen.found(apply(kept.inverse().compose(sensor), points), self.config.least)
        own = self.filter.within(apply(kept, middles), poses, self.config.padding + self.config.cell / 2)
        if self.seen.see(middles[~own], stamp / NANOSECONDS):
            self.publish()
        return len(points)

    def joints_at(self, stamp: int) -> dict[str, float]:
        """Return where joints were at a time."""
        if not self.joints:
            if self.body.moving:
                raise CloudError("nothing has reported where joints are, so that the robot would be taken for a thing")
            return {}
        return min(islice(reversed(self.joints), KNOWN), key=lambda joint: abs(joint[0] - stamp))[1]

    def pose_of(self, frame: str, poses: dict[str, Transform3], stamp: int) -> Transform3:
        """Return a frame in that of the root."""
        if not frame or frame in poses:
            return poses[frame or self.body.root]
        if _look(frame) not in self.bound:
            raise CloudError(f"'{frame}' is no link of the body, and none of the 'frames' of the scene")
        found: Transform3 = self.bound[_look(frame)].transform(at=stamp)
        return found

    def publish(self) -> None:
        """Publish all cells to the scene; those farthest from the frame are left out if there are too many."""
        name, link = self.config.name, self.config.frame or self.body.root
        middles = self.seen.middles()
        if self.is_crowded:
            middles = middles[np.argsort(np.einsum("ij,ij->i", middles, middles))[:MOST_CELLS]]
        one = SceneObject(name=name, link=link)  # without shapes, it is gone
        if len(middles):
            side = self.config.cell
            x, y, z = (np.round(middles.mean(axis=0) / side) * side).tolist()
            shape = Geometry("octree", (side,), points=tuple((middles - (x, y, z)).ravel().tolist()))
            one = object_message(PlacedObject(name, shape, link, Transform3((x, y, z))))
        self.bound["cells"](SceneObjects(objects=(one,)))


def _outside(config: CloudMapperConfig) -> tuple[str, ...]:
    links = body_of(config.urdf).links
    return tuple(frame for frame in dict.fromkeys((*config.frames, config.frame)) if frame and frame not in links)


def _look(frame: str) -> str:
    return f"in_{frame}"
