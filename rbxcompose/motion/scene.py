"""The planning scene: things around the robot, which arms must not hit, and things that they hold."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

from rbxcompose.body.model import Body, Geometry
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3

SIZES: Mapping[str, tuple[str, ...]] = {
    "box": ("x", "y", "z"),
    "cylinder": ("radius", "length"),
    "sphere": ("radius",),
}
"""What the numbers of each shape's size mean."""


class SceneError(ValueError):
    """Raised for a change of the scene that cannot be, with the reason."""


@dataclass(frozen=True, slots=True)
class PlacedObject:
    """A thing that moves with a link of the body, at a pose in its frame; it may touch some links."""

    name: str
    shape: Geometry
    link: str
    pose: Transform3
    touches: tuple[str, ...] = ()


def mistake_in(one: PlacedObject, body: Body) -> str:
    """Return why an object cannot be in the scene, nothing if it can."""
    names = SIZES.get(one.shape.kind)
    if names is None:
        return f"'{one.shape.kind}' is no shape: {', '.join(SIZES)}"
    if len(one.shape.size) != len(names):
        return f"the size of a {one.shape.kind} is {', '.join(names)}"
    if not all(math.isfinite(size) and size > 0.0 for size in one.shape.size):
        return f"a {one.shape.kind} whose size is {', '.join(f'{size:g} m' for size in one.shape.size)} is none"
    if not all(map(math.isfinite, (*one.pose.translation, *one.pose.rotation))):
        return "its pose is not finite"
    if abs(math.hypot(*one.pose.rotation) - 1.0) > 0.01:
        return "its orientation is no rotation"
    if unknown := [link for link in (one.link, *one.touches) if link not in body.links]:
        return f"there is no link '{unknown[0]}'"
    return f"'{one.name}' is a link of the body" if one.name in body.links else ""


class PlanningScene:
    """Objects by name. Poses of links are those in the frame of the body's root."""

    def __init__(self, body: Body, objects: Iterable[PlacedObject] = ()) -> None:
        self.body = body
        self.objects: dict[str, PlacedObject] = {}
        for one in objects:
            self.add(one)

    def add(self, one: PlacedObject) -> None:
        """Put an object into the scene.

        Raises:
            SceneError: if it is there, or cannot be.
        """
        if one.name in self.objects:
            raise SceneError(f"there is an object '{one.name}' already")
        if mistake := mistake_in(one, self.body):
            raise SceneError(mistake)
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
            SceneError: if there is no such object or link.
        """
        one = self._there(name)
        unknown = [each for each in (link, *touches) if each not in self.body.links]
        if unknown:
            raise SceneError(f"there is no link '{unknown[0]}'")
        pose = links[link].inverse().compose(links[one.link].compose(one.pose))
        allowed = tuple(touches) or (link, *self._carried(link))
        self.objects[name] = replace(one, link=link, pose=pose, touches=allowed)

    def detach(self, name: str, links: Mapping[str, Transform3]) -> None:
        """Let an object stay where it is in the frame of the body's root; it may touch nothing then.

        Raises:
            SceneError: if there is no such object.
        """
        one = self._there(name)
        pose = links[one.link].compose(one.pose)
        self.objects[name] = replace(one, link=self.body.root, pose=pose, touches=())

    def _there(self, name: str) -> PlacedObject:
        if name not in self.objects:
            there = ", ".join(self.objects) or "none"
            raise SceneError(f"there is no object '{name}' in the scene; there: {there}")
        return self.objects[name]

    def _carried(self, link: str) -> list[str]:
        children = [joint.child for joint in self.body.joints_below[link]]
        return [name for child in children for name in (child, *self._carried(child))]
