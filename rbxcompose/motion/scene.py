"""The planning scene: things around the robot, which arms must not hit, and things that they hold."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace

from rbxcompose.body.model import Body, Geometry
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3
from rbxcompose.motion.scene_shapes import FIXED, mistake_in_shape

MOST_SHAPES = 1_000
"""More would make each change of the scene take seconds: many small things are one octree."""
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

    @property
    def own_pieces(self) -> tuple[ScenePiece, ...]:
        """Return all shapes with their poses in the frame of the object."""
        return ScenePiece(self.shape, self.shape_pose), *self.pieces

    @property
    def all_pieces(self) -> Iterator[ScenePiece]:
        """Yield all shapes with their poses in the frame of the link."""
        for one in self.own_pieces:
            yield ScenePiece(one.shape, self.pose.compose(one.pose))


@dataclass(frozen=True, slots=True)
class PairDistance:
    """Two links or objects, and the distance between them [m], below 0 if they are within each other."""

    first: str
    second: str
    distance: float
    collides: bool
    """Whether they are nearer than they may be, with all paddings."""


def mistake_in(one: PlacedObject, body: Body, frames: Collection[str] = ()) -> str:
    """Return why an object cannot be in the scene, nothing if it can; `frames` are those outside of the body."""
    for piece in one.own_pieces:
        if wrong := mistake_in_shape(piece.shape) or _mistake_in_pose(piece.pose):
            return wrong
    if wrong := _mistake_in_pose(one.pose):
        return wrong
    if not 0.0 <= one.padding <= MOST_PADDING:
        return f"its padding is {one.padding:g} m: from 0 to {MOST_PADDING:g} m"
    if one.colour is not None and not all(0.0 <= share <= 1.0 for share in one.colour):
        return "the parts of its colour are from 0 to 1"
    if one.link not in body.links and one.link not in frames:
        outer = f"; frames outside of the body: {', '.join(sorted(frames))}" if frames else ""
        return f"there is no link '{one.link}'{outer}"
    if unknown := [link for link in one.touches if link not in body.links]:
        return f"there is no link '{unknown[0]}'"
    if not one.name.isprintable() or one.name != one.name.strip() or not 0 < len(one.name) <= LONGEST_NAME:
        return f"a name has 1 to {LONGEST_NAME} letters, in one line, and no space at its ends"
    if one.name in body.links:
        return f"'{one.name}' is a link of the body"
    return _mistake_in_carrying(one, one.link, body) if one.link in body.links else ""


def _mistake_in_carrying(one: PlacedObject, link: str, body: Body) -> str:
    fixed = [piece.shape.kind for piece in one.all_pieces if piece.shape.kind in FIXED]
    return f"no link that moves can carry its {fixed[0]}" if fixed and link not in body.still else ""


def _mistake_in_pose(pose: Transform3) -> str:
    if not all(map(math.isfinite, (*pose.translation, *pose.rotation))):
        return "its pose is not finite"
    if abs(math.hypot(*pose.rotation) - 1.0) > 0.01:
        return "its orientation is no rotation"
    away = math.hypot(*pose.translation)
    return f"it is {away:g} m away from its frame: at most {FARTHEST:g} m" if away > FARTHEST else ""


def settled(one: PlacedObject, body: Body) -> PlacedObject:
    """Return an object that is in the frame of the root if that of its link never moves."""
    at = body.still.get(one.link) if one.link != body.root else None
    return one if at is None else replace(one, link=body.root, pose=at.compose(one.pose))


class PlanningScene:
    """Objects by name. Poses of links and of `frames` outside of the body are those in the frame of its root."""

    def __init__(self, body: Body, objects: Iterable[PlacedObject] = (), frames: Collection[str] = ()) -> None:
        self.body, self.frames = body, frames
        self.objects: dict[str, PlacedObject] = {}
        self._stood_in: dict[str, str] = {}  # frames outside of the body in which held objects were
        for one in objects:
            self.add(one)

    def add(self, one: PlacedObject) -> None:
        """Put an object into the scene.

        Raises:
            SceneError: if it is there, or cannot be.
        """
        if one.name in self.objects:
            raise SceneError(f"there is an object '{one.name}' already")
        self.put(one)

    def put(self, one: PlacedObject) -> None:
        """Put an object into the scene, in the place of the one that has its name.

        Raises:
            SceneError: if it cannot be.
        """
        if mistake := mistake_in(one, self.body, self.frames):
            raise SceneError(mistake)
        others = (len(each.own_pieces) for each in self.objects.values() if each.name != one.name)
        if len(one.own_pieces) + sum(others) > MOST_SHAPES:
            raise SceneError(f"there would be more than {MOST_SHAPES:,} shapes")
        self.objects[one.name] = one

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
        one = self._there(name)
        unknown = [each for each in (link, *touches) if each not in self.body.links]
        if unknown:
            raise SceneError(f"there is no link '{unknown[0]}'")
        if mistake := _mistake_in_carrying(one, link, self.body):
            raise SceneError(mistake)
        pose = links[link].inverse().compose(self._pose(one, links))
        if one.link not in self.body.links:
            self._stood_in[name] = one.link
        allowed = tuple(touches) or (link, *self._carried(link))
        self.objects[name] = replace(one, link=link, pose=pose, touches=allowed)

    def detach(self, name: str, links: Mapping[str, Transform3]) -> None:
        """Let an object stay where it is, in the frame in which it stood or in the body's root; it may touch nothing.

        Raises:
            SceneError: if there is no such object, or if its frame has no pose.
        """
        one = self._there(name)
        frame, pose = self._stood_in.pop(name, self.body.root), self._pose(one, links)
        if frame in links and frame != self.body.root:
            pose = links[frame].inverse().compose(pose)
        else:
            frame = self.body.root
        self.objects[name] = replace(one, link=frame, pose=pose, touches=())

    def on_body(self, poses: Mapping[str, Transform3]) -> tuple[PlacedObject, ...]:
        """Return all objects in the frames of links that move, and those of all other frames in that of the root.

        Raises:
            SceneError: if such a frame has no pose.
        """
        return tuple(
            settled(one, self.body)
            if one.link in self.body.links
            else replace(one, link=self.body.root, pose=self._pose(one, poses))
            for one in self.objects.values()
        )

    def _pose(self, one: PlacedObject, poses: Mapping[str, Transform3]) -> Transform3:
        if one.link not in poses:
            raise SceneError(f"nothing tells where '{one.link}' is, the frame of '{one.name}'")
        return poses[one.link].compose(one.pose)

    def _there(self, name: str) -> PlacedObject:
        if name not in self.objects:
            there = ", ".join(self.objects) or "none"
            raise SceneError(f"there is no object '{name}' in the scene; there: {there}")
        return self.objects[name]

    def _carried(self, link: str) -> list[str]:
        children = [joint.child for joint in self.body.joints_below[link]]
        return [name for child in children for name in (child, *self._carried(child))]
