"""What a camera has seen, as objects: which sighting is of which object, and which object is gone.

Poses are in one frame that does not move with the camera, lengths in [m], times are robot time [s].
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import replace

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, Vector3

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
        alike = abs(sum(value * other for value, other in zip(before.pose.rotation, now.pose.rotation, strict=True)))
        return max(moved, grown) > self._still or 2.0 * math.acos(min(1.0, alike)) > TURNED
