"""Names of things that are seen again and again: what is nearest to where one was keeps its name.

Positions are in a level frame [m], times are robot time [s].
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from itertools import count

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Vector3
from rbxcompose.domains.vision.tabletop import TabletopThing

ON = 0.02  # how far off the surface of a thing a tag on it may seem to be [m]


@dataclass(frozen=True, slots=True)
class NamedThing:
    """A thing with its name, when it was seen, and whether that is the name of a tag on it."""

    name: str
    thing: TabletopThing
    at: float
    is_tagged: bool


class ThingNames:
    """Gives things names: those of tags on them, which they keep, else `thing_1`, `thing_2` and so on."""

    def __init__(self, near: float, forget: float) -> None:
        """Take things up to `near` apart for the same one, if it was seen less than `forget` ago."""
        self._near, self._forget, self._numbers = near, forget, count(1)
        self._known: dict[str, NamedThing] = {}

    def take(
        self, now: float, things: Sequence[TabletopThing], tags: Sequence[tuple[str, Vector3]] = ()
    ) -> list[NamedThing]:
        """Return things with their names, in the same order; `tags` are names, and where these are seen."""
        self._known = {name: one for name, one in self._known.items() if now - one.at <= self._forget}
        carried = _paired(
            (away, index, tag)
            for index, thing in enumerate(things)
            for tag, at in tags
            if (away := _off_surface(thing, at)) <= ON
        )
        same = _paired(
            (away, index, name)
            for index, thing in enumerate(things)
            if index not in carried
            for name, one in self._known.items()
            if name not in carried.values()
            and (away := math.dist(thing.pose.translation, one.thing.pose.translation)) <= self._near
        )
        found = []
        for index, thing in enumerate(things):
            name = carried.get(index) or same.get(index) or f"thing_{next(self._numbers)}"
            is_tagged = index in carried or (index in same and self._known[name].is_tagged)
            found.append(NamedThing(name, thing, now, is_tagged))
        self._known |= {one.name: one for one in found}
        return found


class SteadyLook:
    """Tells whether the same things were seen at the same places in each of the last pictures."""

    def __init__(self, pictures: int, still: float) -> None:
        """Look at so many pictures, and allow things to be up to `still` elsewhere."""
        self._still = still
        self._seen = deque[dict[str, Vector3]](maxlen=pictures)

    def take(self, things: Iterable[NamedThing]) -> bool:
        """Take what one more picture shows; return whether the last ones agree."""
        last = {one.name: one.thing.pose.translation for one in things}
        self._seen.append(last)
        return len(self._seen) == self._seen.maxlen and all(
            one.keys() == last.keys() and all(math.dist(one[name], last[name]) <= self._still for name in last)
            for one in self._seen
        )


def _paired(pairs: Iterable[tuple[float, int, str]]) -> dict[int, str]:
    """Return numbers with names, the nearest first, each once."""
    found: dict[int, str] = {}
    for _, index, name in sorted(pairs):
        if index not in found and name not in found.values():
            found[index] = name
    return found


def _off_surface(thing: TabletopThing, point: Vector3) -> float:
    """Return how far a point is from the surface of the box around a thing."""
    own = thing.pose.inverse().apply(point)
    beyond = [abs(at) - side / 2 for at, side in zip(own, thing.size, strict=True)]
    outside = math.hypot(*(max(0.0, each) for each in beyond))
    return outside if outside else -max(beyond)
