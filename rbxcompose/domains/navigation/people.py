"""People in the scans of a laser: who looks like one, and who moves; each is tracked from scan to scan.

As K. Arras, O. Martinez Mozos and W. Burgard, Using Boosted Features for the Detection of People in 2D Range Data (ICRA
2007), a scan is cut where distances jump, and as A. Leigh et al., Person Tracking and Following with 2D Laser Scanners
(ICRA 2015; ROS's leg_tracker), a person is who has moved through free space. The threshold of a jump is that of G.
Borges and M. Aldon, Line Extraction in 2D Range Images for Mobile Robotics (JINT 40, 2004); the filter is the one of a
constant velocity in Y. Bar-Shalom et al., Estimation with Applications to Tracking and Navigation (2001), section 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from rbxcompose.base.arrays import Array, ArrayLike, Bools, Ints, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.navigation.costs import distances
from rbxcompose.domains.worlds.grid_map import SOLID, GridMap

GRAZING = math.radians(10)  # of a ray to a surface that is seen as one
LEAST_JUMP = 0.12  # [m]
POINTS = 3  # of a thing at least
LEG, BODY, BROADEST = 0.05, 0.3, 0.8  # [m] least widths of a leg and of a body, the greatest of a body
STRIDE = 0.6  # [m] between two legs of a person
DEPTH = 0.2  # [m] from the points of a body of unknown width to its middle
EXACT, ROUGH = 0.07, 0.2  # [m] standard deviations of who is seen as a whole, and in part
PUSH = 1.0  # [m/s^2] standard deviation of the acceleration of somebody who walks
AT_FIRST = 0.7  # [m/s] standard deviation of the speed of somebody new
GATE = 13.8  # squared Mahalanobis distance that 999 of 1000 keep, with two degrees of freedom
LEAP = 0.8  # [m] between where somebody is expected and seen at most
SEEN_OFTEN = 3  # scans after which somebody is told
DOUBTED = 0.5  # [s] after which somebody who was seen less often is forgotten
MOVED = 0.4  # [m] from where it was first: after that it is no furniture
SHOWN = 0.5  # [s] since the last sighting, up to which somebody is told


class KnownWalls:
    """What of a scan a map explains."""

    def __init__(self, grid: GridMap, margin: float) -> None:
        """Take a map, and how near to its walls [m] an echo is one of them: the error of the map and of the pose."""
        self._grid, self._near = grid, (distances(grid.cells >= SOLID) - 0.5) * grid.resolution <= margin

    def explain(self, points: Array) -> Bools:
        """Return which points (n, 2) of `map` [m] are of a wall; beside the map none is."""
        return self._grid.look_up(self._near, points, False)


@dataclass(frozen=True, slots=True)
class PersonSighting:
    """Something in a scan as large as a person, or as a part of one; its middle is in the fixed frame [m]."""

    x: float
    y: float
    is_whole: bool = True
    """Whether all of it is seen; what is seen in part is no new person."""


def sightings(
    sensor: Pose2, angles: ArrayLike, ranges: ArrayLike, most: float, walls: KnownWalls | None = None
) -> list[PersonSighting]:
    """Return what in a scan may be a person.

    Rays at `angles` [rad] end at `ranges` [m], of a sensor at a pose in the fixed frame; what is beyond `most` [m], or
    explained by the walls of a map in that frame, is nobody.
    """
    angles, ranges = np.asarray(angles, float), np.asarray(ranges, float)
    if len(angles) < POINTS or not np.isfinite(angles).all():
        return []
    with np.errstate(invalid="ignore"):
        counts = (ranges > 0) & (ranges <= most)
    lengths = np.where(counts, ranges, 0.0)
    points = np.stack((np.cos(angles + sensor.heading), np.sin(angles + sensor.heading)), -1)
    points = points * lengths[:, None] + (sensor.x, sensor.y)
    if walls is not None:
        counts &= ~walls.explain(points)
    step = abs(float(angles[1] - angles[0]))
    is_round = step * len(angles) > math.tau - step / 2
    # What a ray does not reach hides nothing; what is nearer than the range of the sensor does.
    blocking = np.where(np.isnan(ranges), np.inf, ranges)
    bodies: list[PersonSighting] = []
    legs: list[PersonSighting] = []
    for part in _pieces(points, lengths, counts, step, is_round):
        first, last = int(part[0]), int(part[-1])
        reach = float(lengths[part].mean())
        width = float(np.hypot(*(points[last] - points[first]))) + reach * step
        if len(part) < POINTS or not LEG <= width <= BROADEST:
            continue
        is_whole = not any(
            _is_hidden(edge, beside, blocking, lengths, step, is_round)
            for edge, beside in ((first, first - 1), (last, last + 1))
        )
        middle = points[part].mean(0)
        # The visible half of a circle is, in the mean over its width, pi/4 of the radius before its middle.
        deep = width * math.pi / 8 if is_whole else DEPTH
        away = middle - (sensor.x, sensor.y)
        x, y = (middle + away * (deep / max(float(np.hypot(*away)), 1e-6))).tolist()
        (bodies if width >= BODY or not is_whole else legs).append(PersonSighting(x, y, is_whole))
    return bodies + _paired(legs)


def _pieces(points: Array, lengths: Array, counts: Bools, step: float, is_round: bool) -> Iterator[Ints]:
    """Yield the indices of the rays of each thing, in their order."""
    after = np.roll(np.arange(len(points)), -1)
    apart = np.hypot(*(points[after] - points).T)
    near = np.minimum(lengths, lengths[after])
    limit = np.maximum(near * math.sin(step) / math.sin(max(GRAZING - step, step)), LEAST_JUMP)
    cut = (apart > limit) | (counts != counts[after])
    if not is_round:
        cut[-1] = True
    ends = np.flatnonzero(cut)
    if not ends.size:
        return
    order = np.roll(np.arange(len(points)), -int(ends[0]) - 1)
    for piece in np.split(order, np.flatnonzero(cut[order])[:-1] + 1):
        if counts[piece[0]]:
            yield piece


def _is_hidden(edge: int, beside: int, ranges: Array, lengths: Array, step: float, is_round: bool) -> bool:
    """Return whether something before it hides what is behind an edge; the end of the view does."""
    if not 0 <= beside < len(ranges):
        if not is_round:
            return True
        beside %= len(ranges)
    return bool(ranges[beside] < lengths[edge] - max(LEAST_JUMP, lengths[edge] * step))


def _paired(legs: list[PersonSighting]) -> list[PersonSighting]:
    """Return a person for two legs, and a part of one for a leg alone."""
    found, left = [], list(legs)
    while left:
        leg = left.pop()
        other = min(left, key=lambda one: math.hypot(one.x - leg.x, one.y - leg.y), default=None)
        if other is not None and math.hypot(other.x - leg.x, other.y - leg.y) <= STRIDE:
            left.remove(other)
            found.append(PersonSighting((leg.x + other.x) / 2, (leg.y + other.y) / 2))
        else:
            found.append(PersonSighting(leg.x, leg.y, False))
    return found


@dataclass(frozen=True, slots=True)
class TrackedPerson:
    """Somebody who is seen now, in the fixed frame."""

    name: str
    x: float
    y: float
    vx: float = 0.0
    """[m/s], as `vy`."""
    vy: float = 0.0
    reliability: float = 1.0
    """0.5 for what only looks like a person, up to 1 for one that has moved."""

    @property
    def speed(self) -> float:
        """[m/s]"""
        return math.hypot(self.vx, self.vy)


class PersonTrack:
    """One person in a Kalman filter: position and velocity."""

    def __init__(self, name: str, seen: PersonSighting, time: float) -> None:
        """Begin where somebody is seen at a time [s]."""
        self.name, self.time, self.seen, self.count = name, time, time, 1
        self.state = np.array((seen.x, seen.y, 0.0, 0.0))
        self.spread = np.diag((EXACT**2, EXACT**2, AT_FIRST**2, AT_FIRST**2))
        self.first, self.moved = (seen.x, seen.y), 0.0

    def predict(self, time: float) -> None:
        """Let somebody walk on until a time [s]."""
        dt, self.time = time - self.time, time
        move = np.eye(4)
        move[0, 2] = move[1, 3] = dt
        push = np.outer((dt * dt / 2, dt), (dt * dt / 2, dt)) * PUSH**2
        self.state = move @ self.state
        self.spread = move @ self.spread @ move.T + np.kron(push, np.eye(2))

    def away(self, seen: PersonSighting) -> float:
        """Return the squared Mahalanobis distance of a sighting, infinite if it is of nobody who was there."""
        error = np.array((seen.x, seen.y)) - self.state[:2]
        if math.hypot(*error) > LEAP:
            return math.inf
        found = float(error @ np.linalg.solve(self.spread[:2, :2] + np.eye(2) * _noise(seen), error))
        return found if found <= GATE else math.inf

    def correct(self, seen: PersonSighting) -> None:
        """Take where somebody is seen at the time of the prediction."""
        gain = self.spread[:, :2] @ np.linalg.inv(self.spread[:2, :2] + np.eye(2) * _noise(seen))
        self.state = self.state + gain @ (np.array((seen.x, seen.y)) - self.state[:2])
        self.spread = self.spread - gain @ self.spread[:2]
        self.seen, self.count = self.time, self.count + 1
        if seen.is_whole:
            self.moved = max(self.moved, math.hypot(seen.x - self.first[0], seen.y - self.first[1]))

    def person(self, time: float, reliability: float) -> TrackedPerson:
        """Return where somebody is expected at a time [s]."""
        x, y, vx, vy = self.state.tolist()
        ahead = max(0.0, time - self.time)
        return TrackedPerson(self.name, x + vx * ahead, y + vy * ahead, vx, vy, reliability)


def _noise(seen: PersonSighting) -> float:
    return (EXACT if seen.is_whole else ROUGH) ** 2


class PeopleTracks:
    """Everybody who is seen, each by a name that stays while somebody is hidden for less than `forget` [s]."""

    def __init__(self, forget: float = 2.0) -> None:
        self.forget = forget
        self._tracks: list[PersonTrack] = []
        self._made = 0
        self._time = -math.inf

    def see(self, seen: Sequence[PersonSighting], time: float) -> None:
        """Take what one scan shows, at a time [s] after that of the last one; an older one counts not."""
        if time <= self._time:
            return
        self._time = time
        for track in self._tracks:
            track.predict(time)
        pairs = [(track.away(one), i, j) for i, track in enumerate(self._tracks) for j, one in enumerate(seen)]
        left, free = set(range(len(self._tracks))), set(range(len(seen)))
        for away, i, j in sorted(pairs):
            if away < math.inf and i in left and j in free:
                self._tracks[i].correct(seen[j])
                left.remove(i)
                free.remove(j)
        for j in sorted(free):
            if seen[j].is_whole:
                self._made += 1
                self._tracks.append(PersonTrack(f"person_{self._made}", seen[j], time))
        self._tracks = [track for track in self._tracks if time - track.seen <= self._kept(track)]

    def _kept(self, track: PersonTrack) -> float:
        return self.forget if track.count >= SEEN_OFTEN else min(DOUBTED, self.forget)

    def people(self, time: float) -> list[TrackedPerson]:
        """Return who is seen at a time [s], where it is expected then."""
        found = []
        for track in self._tracks:
            if track.count < SEEN_OFTEN or time - track.seen > SHOWN:
                continue
            found.append(track.person(time, 0.5 + 0.5 * min(1.0, track.moved / MOVED)))
        return found


class NamedTracks:
    """Everybody who is told apart by a name, which comes with each sighting."""

    def __init__(self, forget: float = 2.0) -> None:
        self.forget = forget
        self._tracks: dict[str, PersonTrack] = {}

    def see(self, name: str, seen: PersonSighting, time: float) -> None:
        """Take where somebody is seen at a time [s]; an older one counts not, and who leaps is new there."""
        track = self._tracks.get(name)
        if track is None or time - track.time > self.forget:
            self._tracks[name] = PersonTrack(name, seen, time)
        elif time > track.time:
            track.predict(time)
            if track.away(seen) < math.inf:
                track.correct(seen)
            else:
                self._tracks[name] = PersonTrack(name, seen, time)

    def people(self, time: float) -> list[TrackedPerson]:
        """Return who is seen at a time [s], where it is expected then."""
        return [track.person(time, 1.0) for track in self._tracks.values() if time - track.seen <= SHOWN]
