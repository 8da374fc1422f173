"""The tree of frames: where each frame is in its parent now, and from that where any frame is in any other."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rbxcompose.geometry import Transform3

MOST_FRAMES = 10_000  # names come from outside; a tree must not grow without bound
UNIT_TOLERANCE = 1e-2  # how far the length of a rotation may differ from 1, as in other transform trees


@dataclass(frozen=True, slots=True)
class TransformAnswer:
    """Answer to `set`: whether the transform was accepted, and a message (a refusal, or a parent that was replaced)."""

    accepted: bool
    message: str = ""


@dataclass(frozen=True, slots=True)
class _Link:
    parent: str
    transform: Transform3
    stamp: float


class TransformTree:
    """Latest pose of every frame in its parent; frames without a common root are not connected."""

    def __init__(self) -> None:
        self._links: dict[str, _Link] = {}  # by child

    @property
    def frames(self) -> frozenset[str]:
        """Names of all frames, roots included."""
        return frozenset(self._links) | {link.parent for link in self._links.values()}

    def parent_of(self, frame: str) -> str | None:
        """Return the parent of `frame`; None for roots and unknown frames."""
        link = self._links.get(frame)
        return link.parent if link else None

    def set(self, parent: str, child: str, transform: Transform3, *, stamp: float, static: bool) -> TransformAnswer:
        """Place `child` in `parent`, or refuse what would not be a tree; a later parent replaces an earlier one.

        `stamp` is the robot time [s] at which the transform was received. A static transform never grows old.
        """
        refusal = self._refusal(parent, child, transform)
        if refusal:
            return TransformAnswer(False, refusal)
        before = self.parent_of(child)
        self._links[child] = _Link(parent, _normalised(transform), math.inf if static else stamp)
        moved = before is not None and before != parent
        return TransformAnswer(True, f"'{child}' has moved from '{before}' to '{parent}'" if moved else "")

    def lookup(self, target: str, source: str) -> Transform3 | None:
        """Return the pose of frame `source` in frame `target`, or None when they are not connected."""
        paths = self._paths(target, source)
        if paths is None:
            return None
        up, down = (self._chain(path) for path in paths)
        return up.inverse().compose(down)

    def stamp_of(self, target: str, source: str) -> float | None:
        """Return the stamp [s] of the oldest dynamic link between two frames.

        It is infinite when all links are static, and None when the frames are not connected.
        """
        paths = self._paths(target, source)
        if paths is None:
            return None
        return min((self._links[frame].stamp for path in paths for frame in path), default=math.inf)

    def age(self, target: str, source: str, now: float) -> float | None:
        """Return how long ago [s] the oldest dynamic link was received: 0 if all are static, None if not connected."""
        stamp = self.stamp_of(target, source)
        return None if stamp is None else max(0.0, now - stamp)

    def _refusal(self, parent: str, child: str, transform: Transform3) -> str:
        if not parent or not child:
            return "a frame needs a name"
        if not all(map(math.isfinite, (*transform.translation, *transform.rotation))):
            return f"the transform of '{child}' contains a number that is not finite"
        if abs(math.hypot(*transform.rotation) - 1.0) > UNIT_TOLERANCE:
            return f"the rotation of '{child}' is not a unit quaternion"
        if child in self._ancestry(parent):
            return f"'{child}' cannot be placed in '{parent}': that is '{child}' itself or is below it"
        if child not in self._links and len(self._links) >= MOST_FRAMES:
            return f"'{child}' is one frame more than the {MOST_FRAMES} that a tree may have"
        return ""

    def _ancestry(self, frame: str) -> list[str]:
        """Return `frame` and all above it, up to its root."""
        found = [frame]
        while link := self._links.get(found[-1]):
            found.append(link.parent)
        return found

    def _paths(self, target: str, source: str) -> tuple[list[str], list[str]] | None:
        """Return the frames below the nearest common ancestor: on the way to `target`, and to `source`."""
        if target == source:
            return ([], []) if target in self.frames else None
        above_target, above_source = self._ancestry(target), self._ancestry(source)
        if above_target[-1] != above_source[-1]:
            return None
        while above_target and above_source and above_target[-1] == above_source[-1]:
            above_target.pop()
            above_source.pop()
        return above_target, above_source

    def _chain(self, path: list[str]) -> Transform3:
        pose = Transform3()
        for frame in path:  # from the leaf upwards
            pose = self._links[frame].transform.compose(pose)
        return pose


def _normalised(transform: Transform3) -> Transform3:
    x, y, z, w = transform.rotation
    length = math.hypot(x, y, z, w)
    return Transform3(transform.translation, (x / length, y / length, z / length, w / length))
