"""What stands on a table, by a cloud of points, and how it is called.

The table is a plane, each thing on it a box or an upright cylinder.

Points are in a level frame, z up, lengths in [m]. A view shows only the near sides of things, so what is hidden is
taken to be there: each thing goes down to the table, and one of which neither the top nor a second side is seen is as
deep as it is wide, away from the camera.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from itertools import count
from typing import Literal, NamedTuple

from rbxcompose.base.arrays import Array, Bools, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, Vector3, quaternion_from_yaw
from rbxcompose.domains.worlds.physics.solids import apply

TRIES = 300  # planes through three points
SAMPLE = 1500  # cells by which these are compared
BEST = 5  # of them are refined
THICK = 0.012  # how far cells of a plane may be from it before it is refined [m]
BROKEN = 0.08  # parts of a table are so near to each other [m]
ALONG = 2.0  # times as wide as others a gap along the sight may be
EDGE = 0.005  # by which a thing may reach over what is seen of the table [m]
FLAT = 0.1  # sine of the angle below which a surface is not measured well
NARROW = 0.2  # the same for what is beside a point, as sides of things are
PLATE = 0.02  # thickness that is made up for a table [m]
FAR_OFF = 0.006  # how far a cell counts as off a side at most, so that few of them do not turn a box [m]
MANY, FINE = 20, 0.004  # cells, and how far these are off a shape [m]: each halves the confidence
SURE = 5  # cells that show where a side is
ON = 0.02  # how far off the surface of a thing a tag on it may seem to be [m]
_TURNS = np.radians(np.arange(0.0, 90.0, 1.0))
_AROUND = np.radians(np.arange(0.0, 360.0, 5.0))
_COMPASS = np.stack((np.cos(_AROUND), np.sin(_AROUND)))  # (2, 72)


class NothingFlatError(ValueError):
    """Raised for a cloud without a table, with the reason."""


@dataclass(frozen=True, slots=True)
class TabletopSettings:
    """Where a table may be, and what counts as a thing on it; lengths in [m], angles in [rad]."""

    lowest: float = 0.3
    """Height of a table, at least."""
    highest: float = 1.3
    """Height of a table, at most."""
    farthest: float = 1.5
    """How far from the camera something counts, seen from above."""
    tallest: float = 0.5
    """How far above the table it ends."""
    gap: float = 0.02
    """What is nearer to each other is one thing."""
    voxel: float = 0.005
    """Side of the cells, each of which becomes one point."""
    tilt: float = math.radians(8)
    """By how much a table, or the frame, may be off the level."""
    area: float = 0.02
    """What must be seen of a table at least [m^2]."""
    clear: float = 0.008
    """How far above the table a thing begins."""
    least: int = 12
    """Cells of a thing, at least."""


@dataclass(frozen=True, slots=True)
class TabletopThing:
    """A box or an upright cylinder."""

    kind: Literal["box", "cylinder"]
    size: Vector3
    """Along the axes of its frame; of a cylinder twice the diameter, and the height."""
    pose: Transform3
    """Of its middle in the level frame: z is up."""
    confidence: float = 1.0
    """From 0 to 1: few cells, and cells that are off the shape, lower it."""


@dataclass(frozen=True, slots=True)
class Tabletop:
    """A table and what stands on it, nearest to the camera first."""

    table: TabletopThing
    things: tuple[TabletopThing, ...]


class TablePlane(NamedTuple):
    """The plane z = a x + b y + c, and how far its cells are off, root mean square."""

    a: float
    b: float
    c: float
    off: float

    def over(self, points: Array) -> Array:
        """Return how far points (n, 3) are above it (n,)."""
        return np.asarray(points[:, 2] - self.heights(points))

    def heights(self, points: Array) -> Array:
        """Return its height at points (n, 2 or 3)."""
        return np.asarray(points[:, :2] @ (self.a, self.b) + self.c)


class _Footprint(NamedTuple):
    """A shape seen from above: its middle, how it is turned, its sides.

    `off` is how far points are off it, root mean square; `miss` is the mean of what counts of that.
    """

    middle: Array
    yaw: float
    sides: tuple[float, float]
    off: float
    miss: float


def find_things(points: Array, camera: Transform3, settings: TabletopSettings | None = None, seed: int = 1) -> Tabletop:
    """Return the table and the things that a camera at a pose in the level frame sees.

    `points` are in the frame of the camera: (n, 3), or (h, w, 3) by pixels, of which those at edges are left out that
    are neither of what is before nor of what is behind. The same points and seed give the same.

    Raises:
        NothingFlatError: if no table is seen.
    """
    settings = settings or TabletopSettings()
    eye = np.array(camera.translation)
    is_known = _is_of_surface(points) if points.ndim == 3 else np.isfinite(points).all(1)
    points = apply(camera, points[is_known])
    if not len(points):
        raise NothingFlatError("the cloud has no points")
    is_near = np.hypot(*(points[:, :2] - eye[:2]).T) <= settings.farthest
    cells = cells_of(points[is_near & (points[:, 2] >= settings.lowest)], settings.voxel)
    low = cells[cells[:, 2] <= settings.highest]
    plane, is_table = table_plane(low, settings, np.random.default_rng(seed))
    top = low[is_table]
    over = plane.over(cells)
    bounds = _hull(top[:, :2])
    clear = max(settings.clear, 4 * plane.off)
    is_on = (over > clear) & (over <= settings.tallest)
    is_on[is_on] = (cells[is_on, :2] @ bounds[:, :2].T + bounds[:, 2] <= EDGE).all(1)
    found = [
        thing
        for part in parts_of(cells[is_on], settings.gap, eye)
        if len(part) >= settings.least and (thing := fitted(part, plane, eye, settings.voxel)) is not None
    ]
    found.sort(key=lambda thing: math.dist(thing.pose.translation, camera.translation))
    return Tabletop(_table(top, plane), tuple(found))


def _is_of_surface(rows: Array) -> Bools:
    """Return which points (h, w, 3) have a neighbour beside and one above or below that are of the same surface, unless
    that is seen from a flat angle: what is as narrow as a pixel is measured badly.
    """
    found = np.asarray(np.isfinite(rows).all(-1))
    with np.errstate(invalid="ignore"):
        for axis, flat in ((0, FLAT), (1, NARROW)):
            first, second = (rows[1:], rows[:-1]) if axis == 0 else (rows[:, 1:], rows[:, :-1])
            way, ray = first - second, first + second
            along = np.einsum("...i,...i", way, ray) ** 2
            joins = along * (1 + flat**2) <= np.einsum("...i,...i", way, way) * np.einsum("...i,...i", ray, ray)
            alike = np.zeros_like(found)
            alike[tuple(slice(1, None) if axis == each else slice(None) for each in (0, 1))] |= joins
            alike[tuple(slice(None, -1) if axis == each else slice(None) for each in (0, 1))] |= joins
            found &= alike
    return found


def cells_of(points: Array, side: float) -> Array:
    """Return the mean of the points (n, 3) in each cell (m, 3)."""
    if not len(points):
        return points
    cells = np.floor(points / side).astype(np.int64)
    cells -= cells.min(0)
    wide, deep, _ = (cells.max(0) + 1).tolist()
    _, which, counts = np.unique(
        (cells[:, 2] * deep + cells[:, 1]) * wide + cells[:, 0], return_inverse=True, return_counts=True
    )
    return np.column_stack([np.bincount(which, points[:, axis]) for axis in range(3)]) / counts[:, None]


def table_plane(cells: Array, settings: TabletopSettings, random: np.random.Generator) -> tuple[TablePlane, Bools]:
    """Return the level plane with the most cells, and which cells (n,) are of it, without other things of its height.

    Three points of similar heights make a plane; the best of them are refined by least squares.

    Raises:
        NothingFlatError: if there is none.
    """
    least = settings.area / settings.voxel**2
    where = f"from {settings.lowest:g} m to {settings.highest:g} m high, and up to {settings.farthest:g} m away"
    if len(cells) < least:
        raise NothingFlatError(f"there is nothing as large as a table {where}")
    steep, sample = math.tan(settings.tilt), cells[random.integers(len(cells), size=SAMPLE)]
    sample = sample[np.argsort(sample[:, 2])]
    first = random.integers(SAMPLE, size=TRIES)
    beside = np.clip(first[:, None] + random.integers(-SAMPLE // 6, SAMPLE // 6, (TRIES, 2)), 0, SAMPLE - 1)
    corners = sample[np.column_stack((first, beside))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    is_flat = np.abs(normals[:, 2]) * steep > np.hypot(normals[:, 0], normals[:, 1])
    normals, corners = normals[is_flat], corners[is_flat]
    slopes = -normals[:, :2] / normals[:, 2:]
    levels = corners[:, 0, 2] - np.einsum("ij,ij->i", slopes, corners[:, 0, :2])
    off = sample[:, 2] - (slopes @ sample[:, :2].T + levels[:, None])
    order = np.argsort(-(np.abs(off) < THICK).sum(1), kind="stable")[:BEST]
    best: tuple[TablePlane, Bools] | None = None
    for index in order:
        found = _refined(
            cells, TablePlane(float(slopes[index, 0]), float(slopes[index, 1]), float(levels[index]), THICK)
        )
        if found is not None and (best is None or found[1].sum() > best[1].sum()):
            best = found
    if best is None or best[1].sum() < least or math.hypot(best[0].a, best[0].b) > steep:
        raise NothingFlatError(f"there is no level plane of {settings.area * 1e4:g} cm^2 {where}")
    plane, is_of = best
    whole = parts_of(cells_of(cells[is_of], 4 * settings.voxel), max(BROKEN, settings.gap))
    bounds = _hull(whole[0][:, :2])
    is_of[is_of] = (cells[is_of, :2] @ bounds[:, :2].T + bounds[:, 2] <= EDGE).all(1)
    return plane, is_of


def _refined(cells: Array, plane: TablePlane) -> tuple[TablePlane, Bools] | None:
    """Return a plane through the cells near one, and which those are; None if there are too few."""
    is_of = np.abs(plane.over(cells)) < THICK
    for _ in range(3):
        if is_of.sum() < 3:
            return None
        near = cells[is_of]
        (a, b, c), *_ = np.linalg.lstsq(np.column_stack((near[:, :2], np.ones(len(near)))), near[:, 2], rcond=None)
        plane = TablePlane(float(a), float(b), float(c), 0.0)
        off = float(np.sqrt(np.mean(plane.over(near) ** 2)))
        plane = plane._replace(off=off)
        is_of = np.abs(plane.over(cells)) < min(THICK, max(0.004, 3 * off))
    return plane, is_of


def _hull(points: Array) -> Array:
    """Return the sides of the convex hull of points (n, 2) as (m, 3): a x + b y + c <= 0 within it."""
    from scipy.spatial import ConvexHull

    return np.asarray(ConvexHull(points).equations)


def parts_of(points: Array, gap: float, eye: Array | None = None) -> list[Array]:
    """Return points (n, 3) in parts that are farther from each other than `gap`, the largest first.

    Along the sight of an eye, gaps may be wider: sides seen from a flat angle have few points.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    if not len(points):
        return []
    first, second = cKDTree(points).query_pairs(gap if eye is None else gap * ALONG, output_type="ndarray").T
    if eye is not None:
        way, sight = points[second] - points[first], points[first] - eye
        along = np.einsum("ij,ij->i", way, sight) / np.linalg.norm(sight, axis=1)
        is_near = (way**2).sum(1) - along**2 * (1 - ALONG**-2) <= gap**2
        first, second = first[is_near], second[is_near]
    links = coo_matrix((np.ones(len(first), bool), (first, second)), shape=(len(points),) * 2)
    _, which = connected_components(links, directed=False)
    order = np.argsort(which, kind="stable")
    parts = np.split(points[order], np.flatnonzero(np.diff(which[order])) + 1)
    return sorted(parts, key=len, reverse=True)


def fitted(cells: Array, plane: TablePlane, eye: Array, voxel: float) -> TabletopThing | None:
    """Return the box or the cylinder that explains the cells (n, 3) of a thing better, seen from `eye`.

    What counts is its outline: the cells of its sides, and the rim of its top, unless that is seen from a flat angle,
    from which a camera measures badly. None if there is no outline.
    """
    over = plane.over(cells)
    height = float(np.percentile(over, 98))
    middle = cells[:, :2].mean(0)
    sight = np.array((*middle, plane.heights(middle[None])[0] + height)) - eye
    is_seen_above = -sight[2] > FLAT * float(np.linalg.norm(sight))
    is_top = over > height - 2 * voxel
    outline = cells[~is_top, :2]
    if is_seen_above:
        top = cells[is_top, :2]
        ahead = top @ _COMPASS
        outline = np.concatenate((outline, top[(ahead >= ahead.max(0) - voxel / 2).any(1)]))
    if len(outline) < SURE:
        return None
    box, round_ = _rectangle(outline, sight[:2], is_seen_above, voxel), _circle(outline)
    is_round = round_ is not None and round_.miss < box.miss
    kind: Literal["box", "cylinder"] = "cylinder" if is_round else "box"
    best = round_ if round_ is not None and is_round else box
    low = float(plane.heights(best.middle[None])[0])
    x, y = best.middle.tolist()
    pose = Transform3((x, y, low + height / 2), quaternion_from_yaw(best.yaw))
    confidence = len(outline) / (len(outline) + MANY) / (1 + (best.off / FINE) ** 2)
    return TabletopThing(kind, (*best.sides, height), pose, confidence)


def _circle(points: Array) -> _Footprint | None:
    """Return the circle nearest to points (n, 2); None if they are too flat to be part of one."""
    middle = points.mean(0)
    own = points - middle
    found, *_ = np.linalg.lstsq(np.column_stack((2 * own, np.ones(len(own)))), (own**2).sum(1), rcond=None)
    at, radius = found[:2], math.sqrt(max(0.0, float(found[2] + found[:2] @ found[:2])))
    for _ in range(8):  # by Gauss and Newton: the distances count, and not their squares, which prefer small circles
        away = own - at
        far = np.maximum(np.hypot(*away.T), 1e-9)
        slopes = np.column_stack((away / far[:, None], np.ones(len(own))))
        step, *_ = np.linalg.lstsq(slopes, far - radius, rcond=None)
        at, radius = at + step[:2], radius + float(step[2])
    wide = float(np.ptp(own @ _COMPASS, axis=0).max())
    if not 0 < 2 * radius < 1.4 * wide:
        return None
    return _Footprint(middle + at, 0.0, (2 * radius, 2 * radius), *_missed(np.hypot(*(own - at).T) - radius))


def _missed(off: Array) -> tuple[float, float]:
    """Return how far points are off a shape (n,): root mean square, and mean of what counts."""
    return float(np.sqrt(np.mean(off**2))), float(np.minimum(np.abs(off), FAR_OFF).mean())


def _rectangle(points: Array, sight: Array, is_seen_above: bool, voxel: float) -> _Footprint:
    """Return the rectangle to whose sides points (n, 2) are nearest; what is hidden along `sight` is made up."""
    middle = points.mean(0)
    own = points - middle
    turn = float(_TURNS[np.argmin(_off_sides(own, _TURNS))])
    near = turn + np.radians(np.arange(-1.0, 1.01, 0.1))
    turn = float(near[np.argmin(_off_sides(own, near))])
    cos, sin = math.cos(turn), math.sin(turn)
    turned = own @ np.array(((cos, -sin), (sin, cos)))
    low, high = (np.percentile(turned, share, axis=0) for share in (0.5, 99.5))
    gaps = np.column_stack((turned - low, high - turned))  # to the sides at low x, low y, high x, high y
    nearest = np.abs(gaps).argmin(1)
    for side in range(4):
        mine = turned[(nearest == side) & (np.abs(gaps[:, side]) < voxel), side % 2]
        if len(mine) >= SURE:
            (low if side < 2 else high)[side % 2] = np.median(mine)
    missed = _missed(_gaps(turned, low, high))
    thin = int(np.argmin(high - low))
    if not is_seen_above and (high - low)[thin] < 3 * voxel:
        depth = float((high - low)[1 - thin])
        if (sight @ np.array(((cos, -sin), (sin, cos))))[thin] > 0:
            high[thin] = low[thin] + depth
        else:
            low[thin] = high[thin] - depth
    size = high - low
    at = middle + np.array(((cos, -sin), (sin, cos))) @ ((low + high) / 2)
    if turn >= math.pi / 4:
        return _Footprint(at, turn - math.pi / 2, (float(size[1]), float(size[0])), *missed)
    return _Footprint(at, turn, (float(size[0]), float(size[1])), *missed)


def _off_sides(points: Array, turns: Array) -> Array:
    """Return how far points (n, 2) are off the sides of the rectangle around them at each turn (m,)."""
    cos, sin = np.cos(turns), np.sin(turns)
    turned = np.stack((points @ np.stack((cos, sin)), points @ np.stack((-sin, cos))), -1)  # (n, m, 2)
    low, high = np.percentile(turned, 1, axis=0), np.percentile(turned, 99, axis=0)
    return np.asarray(np.minimum(_gaps(turned, low, high), FAR_OFF).mean(0))


def _gaps(turned: Array, low: Array, high: Array) -> Array:
    """Return how far points (..., 2) are from the nearest side of a rectangle."""
    return np.asarray(np.minimum(np.abs(turned - low), np.abs(high - turned)).min(-1))


def _table(top: Array, plane: TablePlane) -> TabletopThing:
    """Return a table as a plate of which its cells (n, 3) are the upper side: what is below is not seen."""
    from scipy.spatial import ConvexHull

    corners = top[ConvexHull(top[:, :2]).vertices, :2]
    ways = np.roll(corners, -1, 0) - corners
    turns = np.arctan2(ways[:, 1], ways[:, 0]) % (math.pi / 2)
    cos, sin = np.cos(turns), np.sin(turns)
    turned = np.stack((corners @ np.stack((cos, sin)), corners @ np.stack((-sin, cos))), -1)
    low, high = turned.min(0), turned.max(0)
    best = int(np.argmin((high - low).prod(1)))
    size, (x, y) = high[best] - low[best], ((low + high) / 2)[best].tolist()
    x, y = x * cos[best] - y * sin[best], x * sin[best] + y * cos[best]
    level = float(plane.heights(np.array([(x, y)]))[0])
    pose = Transform3((float(x), float(y), level - PLATE / 2), quaternion_from_yaw(float(turns[best])))
    return TabletopThing("box", (float(size[0]), float(size[1]), PLATE), pose)


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

    def __len__(self) -> int:
        """Return how many pictures have come, at most as many as are wanted."""
        return len(self._seen)

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
