"""The planning scene: things around the robot, which arms must not hit, and things that they hold."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.body.model import Body, Geometry
from rbxcompose.sdk.ports import MessageLimits

SIZES: Mapping[str, tuple[str, ...]] = {
    "box": ("x", "y", "z"),
    "cylinder": ("radius", "length"),
    "cone": ("radius", "length"),
    "sphere": ("radius",),
    "plane": ("a", "b", "c", "d"),
    "mesh": ("scale along x", "y", "z"),
    "octree": ("side of a cell",),
}
"""What the numbers of each shape's size mean. A plane is all that is below ax + by + cz + d = 0."""
LEAST, GREATEST = 1e-4, 100.0
"""[m] that a length may have: smaller things would slip through between examined positions, larger ones are planes."""
MOST_POINTS = 200_000
"""Corners of a mesh, or cells of an octree."""
PLANE, MESH, OCTREE = "plane", "mesh", "octree"
FIXED = (PLANE, OCTREE)
"""Shapes that no link carries."""


def mistake_in_shape(shape: Geometry) -> str:
    """Return why a shape cannot be in the scene, nothing if it can."""
    names = SIZES.get(shape.kind)
    if names is None:
        return f"'{shape.kind}' is no shape: {', '.join(SIZES)}"
    if len(shape.size) != len(names):
        return f"the size of a {shape.kind} is {', '.join(names)}"
    if not all(map(math.isfinite, (*shape.size, *shape.points))):
        return f"a number of its {shape.kind} is not finite"
    if shape.kind == PLANE:
        return "" if abs(math.hypot(*shape.size[:3]) - 1.0) <= 0.01 else "the length of its normal is not 1"
    if shape.kind in (MESH, OCTREE):
        return _mistake_in_points(shape)
    if wrong := [size for size in shape.size if not LEAST <= size <= GREATEST]:
        return f"a length of its {shape.kind} is {wrong[0]:g} m: it is at least {LEAST:g} m and at most {GREATEST:g} m"
    return ""


def _mistake_in_points(shape: Geometry) -> str:
    if shape.kind == MESH and 0.0 in shape.size:
        return "a scale of its mesh is 0"
    if shape.kind == OCTREE and not 1e-3 <= shape.size[0] <= 1.0:
        return f"a cell of its octree is {shape.size[0]:g} m wide: from 1 mm to 1 m"
    if shape.file:
        return ""
    count, rest = divmod(len(shape.points), 3)
    if not count or rest:
        return f"its {shape.kind} has no points"
    if count > MOST_POINTS:
        return f"its {shape.kind} has {count:,} points, and may have {MOST_POINTS:,}"
    if shape.kind == MESH:
        if not shape.triangles or len(shape.triangles) % 3:
            return "its mesh has no triangles"
        if not 0 <= min(shape.triangles) <= max(shape.triangles) < count:
            return "a triangle of its mesh has a corner that there is not"
    extent = max(map(abs, shape.points)) * (max(map(abs, shape.size)) if shape.kind == MESH else 1.0)
    return "" if extent <= GREATEST else f"its {shape.kind} reaches {extent:g} m far: at most {GREATEST:g} m"


MOST_SHAPES = 1_000
"""More would make each change of the scene take seconds: many small things are one octree."""
SCENE_LIMITS = MessageLimits(size=16 * 1024 * 1024, entries=10_000)
"""Of messages with objects: enough for so many shapes, or for an octree of some centimetres in a hall."""
MOST_PADDING = 1.0  # [m]
LONGEST_NAME = 200
FARTHEST = 10_000.0  # [m] from its frame
Colour = tuple[float, float, float, float]


class SceneError(ValueError):
    """Raised for a change of the scene that cannot be, with the reason."""


@dataclass(frozen=True, slots=True)
class ScenePiece:
    """A shape of an object, and its pose in the object's frame."""

    shape: Geometry
    pose: Transform3


@dataclass(frozen=True, slots=True)
class PlacedObject:
    """A thing that moves with a link of the body, at a pose in its frame; it may touch some links.

    `link` may be a frame outside of the body, such as `map`. `pieces` are further shapes, `colour` is red, green, blue
    and opacity from 0 to 1, `padding` [m] how far all else keeps from it.
    """

    name: str
    shape: Geometry
    link: str
    pose: Transform3
    touches: tuple[str, ...] = ()
    touches_objects: tuple[str, ...] = ()
    pieces: tuple[ScenePiece, ...] = ()
    colour: Colour | None = None
    padding: float = 0.0
    shape_pose: Transform3 = Transform3()

    @classmethod
    def of(cls, name: str, link: str, pose: Transform3, pieces: Sequence[ScenePiece], **more: Any) -> Self:
        """Return an object of one shape or more."""
        first, *rest = pieces
        return cls(name, first.shape, link, pose, pieces=tuple(rest), shape_pose=first.pose, **more)

    @property
    def own_pieces(self) -> tuple[ScenePiece, ...]:
        """Return all shapes with their poses in the frame of the object."""
        return ScenePiece(self.shape, self.shape_pose), *self.pieces

    @property
    def all_pieces(self) -> Iterator[ScenePiece]:
        """Yield all shapes with their poses in the frame of the link."""
        for piece in self.own_pieces:
            yield ScenePiece(piece.shape, self.pose.compose(piece.pose))


@dataclass(frozen=True, slots=True)
class PairDistance:
    """Two links or objects, and the distance between them [m], below 0 if they are within each other."""

    first: str
    second: str
    distance: float
    collides: bool
    """Whether they are nearer than they may be, with all paddings."""


def mistake_in(thing: PlacedObject, body: Body, frames: Collection[str] = ()) -> str:
    """Return why an object cannot be in the scene, nothing if it can; `frames` are those outside of the body."""
    for piece in thing.own_pieces:
        if wrong := mistake_in_shape(piece.shape) or _mistake_in_pose(piece.pose):
            return wrong
    if wrong := _mistake_in_pose(thing.pose):
        return wrong
    if not 0.0 <= thing.padding <= MOST_PADDING:
        return f"its padding is {thing.padding:g} m: from 0 to {MOST_PADDING:g} m"
    if thing.colour is not None and not all(0.0 <= share <= 1.0 for share in thing.colour):
        return "the parts of its colour are from 0 to 1"
    if thing.link not in body.links and thing.link not in frames:
        outer = f"; frames outside of the body: {', '.join(sorted(frames))}" if frames else ""
        return f"there is no link '{thing.link}'{outer}"
    if unknown := [link for link in thing.touches if link not in body.links]:
        return f"there is no link '{unknown[0]}'"
    if not thing.name.isprintable() or thing.name != thing.name.strip() or not 0 < len(thing.name) <= LONGEST_NAME:
        return f"a name has 1 to {LONGEST_NAME} letters, in one line, and no space at its ends"
    if thing.name in body.links:
        return f"'{thing.name}' is a link of the body"
    return _mistake_in_carrying(thing, thing.link, body) if thing.link in body.links else ""


def mistake_among(things: Collection[PlacedObject], body: Body) -> str:
    """Return why objects cannot be in the scene together, nothing if they can."""
    if too_many := _too_many(things):
        return too_many
    wrong = ((thing.name, mistake_in(thing, body)) for thing in things)
    return next((f"object '{name}': {words}" for name, words in wrong if words), "")


def _too_many(things: Iterable[PlacedObject]) -> str:
    shapes = sum(len(thing.own_pieces) for thing in things)
    return f"there would be {shapes:,} shapes, and may be {MOST_SHAPES:,}" if shapes > MOST_SHAPES else ""


def _mistake_in_carrying(thing: PlacedObject, link: str, body: Body) -> str:
    fixed = [piece.shape.kind for piece in thing.all_pieces if piece.shape.kind in FIXED]
    return f"no link that moves can carry its {fixed[0]}" if fixed and link not in body.still else ""


def _mistake_in_pose(pose: Transform3) -> str:
    if not all(map(math.isfinite, (*pose.translation, *pose.rotation))):
        return "its pose is not finite"
    if abs(math.hypot(*pose.rotation) - 1.0) > 0.01:
        return "its orientation is no rotation"
    away = math.hypot(*pose.translation)
    return f"it is {away:g} m away from its frame: at most {FARTHEST:g} m" if away > FARTHEST else ""


def settled(thing: PlacedObject, body: Body) -> PlacedObject:
    """Return an object that is in the frame of the root if that of its link never moves."""
    at = body.still.get(thing.link) if thing.link != body.root else None
    return thing if at is None else replace(thing, link=body.root, pose=at.compose(thing.pose))


class PlanningScene:
    """Objects by name. Poses of links and of `frames` outside of the body are those in the frame of its root."""

    def __init__(self, body: Body, objects: Iterable[PlacedObject] = (), frames: Collection[str] = ()) -> None:
        self.body, self.frames = body, frames
        self.objects: dict[str, PlacedObject] = {}
        self.stood_in: dict[str, str] = {}  # frames outside of the body in which held objects were
        for thing in objects:
            self.add(thing)

    def add(self, thing: PlacedObject) -> None:
        """Put an object into the scene.

        Raises:
            SceneError: if it is there, or cannot be.
        """
        if thing.name in self.objects:
            raise SceneError(f"there is an object '{thing.name}' already")
        self.put(thing)

    def put(self, thing: PlacedObject) -> None:
        """Put an object into the scene, in the place of the one that has its name.

        Raises:
            SceneError: if it cannot be.
        """
        if mistake := mistake_in(thing, self.body, self.frames):
            raise SceneError(mistake)
        objects = self.objects | {thing.name: thing}
        if too_many := _too_many(objects.values()):
            raise SceneError(too_many)
        self.objects[thing.name] = thing

    def remove(self, name: str) -> None:
        """Take an object out of the scene.

        Raises:
            SceneError: if it is not there.
        """
        del self.objects[self._there(name).name]

    def attach(self, name: str, link: str, touches: Iterable[str], links: Mapping[str, Transform3]) -> None:
        """Let an object move with a link from now on; it stays where it is.

        It may touch `touches`; without any, the link itself and all that the link carries.

        Raises:
            SceneError: if there is no such object or link, or if its frame has no pose.
        """
        thing = self._there(name)
        unknown = [each for each in (link, *touches) if each not in self.body.links]
        if unknown:
            raise SceneError(f"there is no link '{unknown[0]}'")
        if mistake := _mistake_in_carrying(thing, link, self.body):
            raise SceneError(mistake)
        pose = links[link].inverse().compose(self._pose(thing, links))
        if thing.link not in self.body.links:
            self.stood_in[name] = thing.link
        allowed = tuple(touches) or (link, *self.body.carried(link))
        self.objects[name] = replace(thing, link=link, pose=pose, touches=allowed)

    def is_held(self, thing: PlacedObject) -> bool:
        """Return whether a link holds an object: it is in its frame, and not in that of the root."""
        return thing.link in self.body.links and thing.link != self.body.root

    def detach(self, name: str, links: Mapping[str, Transform3]) -> None:
        """Let an object stay where it is, in the frame in which it stood or in the body's root; it may touch nothing.

        Raises:
            SceneError: if there is no such object, if no link holds it, or if its frame has no pose.
        """
        thing = self._there(name)
        if not (self.is_held(thing) or thing.touches):
            raise SceneError(f"no link holds '{name}'")
        frame, pose = self.stood_in.pop(name, self.body.root), self._pose(thing, links)
        if frame in links and frame != self.body.root:
            pose = links[frame].inverse().compose(pose)
        else:
            frame = self.body.root
        self.objects[name] = replace(thing, link=frame, pose=pose, touches=())

    def on_body(self, poses: Mapping[str, Transform3]) -> tuple[PlacedObject, ...]:
        """Return all objects in the frames of links that move, and those of all other frames in that of the root.

        Raises:
            SceneError: if such a frame has no pose.
        """
        return tuple(
            settled(thing, self.body)
            if thing.link in self.body.links
            else replace(thing, link=self.body.root, pose=self._pose(thing, poses))
            for thing in self.objects.values()
        )

    def _pose(self, thing: PlacedObject, poses: Mapping[str, Transform3]) -> Transform3:
        if thing.link not in poses:
            raise SceneError(f"no transform to '{thing.link}' is known, the frame of '{thing.name}'")
        return poses[thing.link].compose(thing.pose)

    def _there(self, name: str) -> PlacedObject:
        if name not in self.objects:
            there = ", ".join(self.objects) or "none"
            raise SceneError(f"there is no object '{name}' in the scene; there: {there}")
        return self.objects[name]
