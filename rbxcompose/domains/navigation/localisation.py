"""Where a robot is in a map, by a laser and odometry: Monte Carlo localisation with a number of particles that adapts.

After S. Thrun, W. Burgard and D. Fox, Probabilistic Robotics (2005): the likelihood field (section 6.4), the sampled
odometry motion model (5.4), augmented MCL (8.3.3) and KLD-sampling (8.3.4).
"""

from __future__ import annotations

import math

from rbxcompose.base.arrays import Array, ArrayLike, Bools, Indices, Ints, Singles, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.grid_map import SOLID, GridMap

BIN, TURN_BIN = 0.25, math.radians(10)  # sides of the bins in which particles are counted [m], [rad]
KLD_ERROR, KLD_QUANTILE = 0.05, 2.33  # of KLD-sampling: the error that 99 of 100 samples keep
NEAR, TURN_NEAR = 0.5, math.radians(30)  # from the middle of a cluster to its members [m], [rad]
SHIFTS = 3  # of a cluster's middle towards the mean of its members
LIGHTER = 3.0  # times, up to which the estimate stays in a cluster: a scan may favour another one by chance
EFFECTIVE = 0.05  # share of the particles that a scan leaves effective at least
HALVINGS = 12  # of the interval in which a scan's power is searched
AT_ONCE = 500  # particles
CANDIDATES = 5000  # poses at random among which a scan may find the robot again
RARE = 1e-9  # of the belief that it is elsewhere: people and furniture alone shall hardly prove that


@dataclass(frozen=True, slots=True)
class LocalisationSettings:
    """How a particle filter moves and weighs; the noise of odometry is in standard deviations."""

    least: int = 500
    """Particles at least."""
    most: int = 2000
    """Particles at most, after the first scan."""
    anywhere: int = 50_000
    """Particles until the first scan if the robot may be anywhere."""
    turn_from_turn: float = 0.1
    """Error of the heading for a turn [rad/rad]: the root of Thrun's alpha 1."""
    turn_from_way: float = 0.1
    """Error of the heading for a way [rad/m]: the root of alpha 2."""
    way_from_way: float = 0.1
    """Error of the length of a way [m/m]: the root of alpha 3."""
    way_from_turn: float = 0.02
    """Error of the position for a turn [m/rad]: the root of alpha 4."""
    beams: int = 60
    """Of a scan that are weighed, evenly chosen from those with an echo."""
    sigma_hit: float = 0.1
    """Standard deviation of the distance between an echo and the map [m]: mostly errors of the map and of the pose."""
    hit: float = 0.9
    """Weight of echoes from what the map shows."""
    random: float = 0.1
    """Weight of echoes from anything else: people, furniture."""
    farthest: float = 12.0
    """Echoes from farther are left out [m]."""
    way: float = 0.2
    """How far the robot moves before it weighs the next scan [m]: from the same place, a scan tells nothing new, and
    its errors would count again."""
    turn: float = 0.3
    """How far it turns before that [rad]: a wrong scale of 10 % then moves an echo at 5 m by less than 2 sigma."""
    slow: float = 0.0
    """Rate at which the long-term mean of likelihoods follows scans, as 0.05; 0 for no recovery of a robot that was
    carried away, or begins anywhere. With recovery, a robot may leave its pose where most echoes are not of the map."""
    fast: float = 0.0
    """Rate of the short-term mean, as 0.4; when it falls below the other, poses anywhere are weighed, too."""


class ParticleFilter:
    """Particles that stand for where a robot may be; all weigh the same, and at first they are anywhere.

    `move` takes all odometry, also while there are no scans; `see` takes a scan at the newest odometry. The same seed
    and inputs give the same poses.

    Raises:
        ValueError: if the map has no free cell.
    """

    def __init__(self, grid: GridMap, settings: LocalisationSettings | None = None, seed: int = 1) -> None:
        self.grid, self.settings = grid, settings or LocalisationSettings()
        self._random = np.random.default_rng(seed)
        self._table = _log_likelihoods(grid, self.settings)
        self._free = np.argwhere((grid.cells >= 0) & (grid.cells < SOLID))
        if not len(self._free):
            raise ValueError("the map has no free cell")
        self._odometry: Pose2 | None = None
        self._sampled = Pose2()  # odometry up to which particles have moved
        self.correction = Pose2()
        """Pose of the odometry's frame in `map`; only starts and scans change it, and the first odometry."""
        self.quality = math.nan
        """Share of the newest scan's beams that end within two sigma of something in the map, seen from the pose; no
        number before the first scan."""
        self.start_anywhere()

    def start(self, pose: Pose2, spread: float, turn_spread: float, *others: Pose2) -> None:
        """Begin around a pose in `map`, with standard deviations of both coordinates [m] and the heading [rad].

        It may as well be at one of `others`: the next scan decides.

        Raises:
            ValueError: if the pose is outside of the map, or a number is not finite or a spread is below zero.
        """
        if not (0 <= spread < math.inf and 0 <= turn_spread < math.inf and math.isfinite(pose.heading)):
            raise ValueError("a start has finite numbers, and spreads of at least zero")
        column, row = self.grid.to_cells((pose.x, pose.y)).tolist()
        rows, columns = self.grid.cells.shape
        if not (0 <= column < columns and 0 <= row < rows):
            raise ValueError(f"a start at ({pose.x:g} m, {pose.y:g} m) is outside of the map")
        middles = np.array([(one.x, one.y, one.heading) for one in (pose, *others)]).repeat(self.settings.most, axis=0)
        noise = self._random.standard_normal(middles.shape) * (spread, spread, turn_spread)
        self._begin(middles + noise, pose)

    def start_anywhere(self) -> None:
        """Begin with no idea: evenly on all free cells, with any heading."""
        poses = self._anywhere(self.settings.anywhere)
        self._begin(poses, _clustered(poses, np.full(len(poses), 1 / len(poses))))

    def move(self, odometry: Pose2) -> None:
        """Take the newest pose that odometry tells; only differences count.

        Raises:
            ValueError: if it is not finite.
        """
        if not all(map(math.isfinite, (odometry.x, odometry.y, odometry.heading))):
            raise ValueError(f"odometry is three finite numbers, not {odometry}")
        if self._odometry is None:
            self._sampled = odometry
            self.correction = self.correction.compose(odometry.inverse())
        self._odometry = odometry
        # In steps of about the same length: the noise shall not depend on how often odometry comes.
        step = self._sampled.inverse().compose(odometry)
        if math.hypot(step.x, step.y) >= self.settings.way or abs(step.heading) >= self.settings.turn:
            self._sample()
            self._is_due = True

    def see(self, sensor: Pose2, angles: ArrayLike, ranges: ArrayLike, *, anew: bool = False) -> bool:
        """Take a scan of a sensor at a pose in the base: rays at `angles` (n,) [rad] end at `ranges` (n,) [m].

        Ranges that are infinite, no number, or not above zero are left out, as are angles that are not finite: a
        likelihood field says nothing of rays that end nowhere. Returns whether the scan was weighed and the particles
        resampled; it is not before the robot has moved on since the last one, except `anew`: among a few places, scans
        from the same one decide.
        """
        points = self._echoes(sensor, np.asarray(angles, float), np.asarray(ranges, float))
        if not len(points):
            return False
        if is_due := self._is_due or anew:
            self._sample()
            self._weigh(points)
            self._is_due = False
        at = np.array([(self.pose.x, self.pose.y, self.pose.heading)])
        limit = math.log(self.settings.hit * math.exp(-2) + self.settings.random)  # at 2 sigma
        self.quality = float((self._look_up(at, points) >= limit).mean())
        return is_due

    @property
    def has_moved(self) -> bool:
        """Return whether it has taken any odometry: before that, the correction does not count."""
        return self._odometry is not None

    @property
    def pose(self) -> Pose2:
        """Return where the robot is in `map`: the middle of the heaviest cluster at the last scan, and moved since.

        The mean of all would be between two places that look alike, where the robot is surely not.
        """
        return self.correction.compose(self._odometry or Pose2())

    @property
    def poses(self) -> Array:
        """Return the particles (n, 3) as x, y [m] and heading [rad] in `map`."""
        step = self._step()
        return _moved(self._poses, step.x, step.y, step.heading)

    @property
    def covariance(self) -> Array:
        """Return the covariance (3, 3) of x, y and heading of all particles around the pose [m^2, m rad, rad^2]."""
        away = self.poses - (self.pose.x, self.pose.y, self.pose.heading)
        away[:, 2] = _wrapped(away[:, 2])
        return away.T @ away / len(away)

    def _begin(self, poses: Array, estimate: Pose2) -> None:
        self._poses = poses
        self._is_due = True
        self._slow = self._fast = self.settings.hit * math.exp(-0.5) + self.settings.random  # at one sigma: it fits
        self.quality = math.nan
        self._sampled = self._odometry or Pose2()
        self.correction = estimate.compose(self._sampled.inverse())

    def _anywhere(self, count: int) -> Array:
        cells = self._free[self._random.integers(len(self._free), size=count)]
        spots = self.grid.to_points(cells[:, ::-1] + self._random.random((count, 2)))
        return np.column_stack((spots, self._random.uniform(-math.pi, math.pi, count)))

    def _step(self) -> Pose2:
        """Return the motion that particles have not made yet, in the base."""
        return self._sampled.inverse().compose(self._odometry or Pose2())

    def _sample(self) -> None:
        """Move all particles up to the newest odometry, each with errors of its own."""
        noise, step = self.settings, self._step()
        way = math.hypot(step.x, step.y)
        spread = math.hypot(noise.way_from_way * way, noise.way_from_turn * step.heading)
        turn_spread = math.hypot(noise.turn_from_turn * step.heading, noise.turn_from_way * way)
        x, y, turn = self._random.standard_normal((3, len(self._poses)))
        self._poses = _moved(self._poses, step.x + spread * x, step.y + spread * y, step.heading, turn_spread * turn)
        self._sampled = self._odometry or Pose2()

    def _weigh(self, points: Singles) -> None:
        """Replace the particles by those that fit to a scan, and the estimate by the middle of most of them."""
        poses, fits = self._poses, self._fits(self._poses, points)
        priors = np.full(len(poses), 1 / len(poses))
        if lost := RARE * self._lost(float(np.exp(fits / len(points)).mean())):
            others = self._anywhere(CANDIDATES)
            poses, fits = np.concatenate((poses, others)), np.concatenate((fits, self._fits(others, points)))
            priors = np.concatenate(((1 - lost) * priors, np.full(CANDIDATES, lost / CANDIDATES)))
        weights = _tempered(fits, priors)
        self.correction = _clustered(poses, weights, self.pose).compose(self._sampled.inverse())
        self._poses = poses[self._drawn(weights, self._enough(poses, weights))]

    def _lost(self, likelihood: float) -> float:
        """Return how likely the robot is anywhere else, by how the mean likelihood of an echo has fallen lately."""
        settings = self.settings
        self._slow += settings.slow * (likelihood - self._slow)
        self._fast += settings.fast * (likelihood - self._fast)
        return max(0.0, 1 - self._fast / self._slow)

    def _enough(self, poses: Array, weights: Array) -> int:
        """Return how many particles to draw: with the bins that they fill, more are needed (Fox's bound)."""
        settings = self.settings
        draws = self._random.choice(len(weights), settings.most, p=weights)
        _, firsts = np.unique(_bins(poses)[draws], return_index=True)
        filled = np.zeros(settings.most)
        filled[firsts] = 1
        others = np.maximum(np.cumsum(filled) - 1, 1)
        part = 2 / (9 * others)
        needed = others / (2 * KLD_ERROR) * (1 - part + np.sqrt(part) * KLD_QUANTILE) ** 3
        is_enough = np.arange(1, settings.most + 1) >= np.maximum(needed, settings.least)
        return int(is_enough.argmax()) + 1 if is_enough.any() else settings.most

    def _drawn(self, weights: Array, count: int) -> Indices:
        """Return as many indices, by weight: systematically, which adds the least noise."""
        steps = (np.arange(count) + self._random.random()) / max(1, count)
        return np.minimum(np.searchsorted(np.cumsum(weights), steps), len(weights) - 1)

    def _echoes(self, sensor: Pose2, angles: Array, ranges: Array) -> Singles:
        """Return the points (n, 2) in the base [m] at which some rays end."""
        with np.errstate(invalid="ignore"):
            echoes = np.flatnonzero((ranges > 0) & (ranges <= self.settings.farthest) & np.isfinite(angles))
        if len(echoes) > self.settings.beams:
            echoes = echoes[np.arange(self.settings.beams) * len(echoes) // self.settings.beams]
        along = angles[echoes] + sensor.heading
        x, y = sensor.x + ranges[echoes] * np.cos(along), sensor.y + ranges[echoes] * np.sin(along)
        return np.stack((x, y), -1).astype(np.float32)

    def _fits(self, poses: Array, points: Singles) -> Singles:
        """Return the logarithm of a scan's likelihood for each pose; some at once, so that they stay in the cache."""
        parts = range(0, len(poses), AT_ONCE)
        return np.concatenate([self._look_up(poses[at : at + AT_ONCE], points).sum(1) for at in parts])

    def _look_up(self, poses: Array, points: Singles) -> Singles:
        """Return the logarithms of likelihoods (poses, points) of echoes that particles have at points of the base."""
        side, table = self.grid.resolution, self._table
        column, row = self.grid.to_cells(poses[:, :2]).T
        heading = poses[:, 2] - self.grid.origin.heading
        cos, sin = np.cos(heading) / side, np.sin(heading) / side
        # Counted from the table's margin of one cell; one product of matrices is faster than a sum of columns.
        around = np.vstack((points.T, np.ones(len(points), np.float32)))
        columns = np.column_stack((cos, -sin, column + 1)).astype(np.float32) @ around
        rows = np.column_stack((sin, cos, row + 1)).astype(np.float32) @ around
        np.clip(columns, 0, table.shape[1] - 1, out=columns)
        np.clip(rows, 0, table.shape[0] - 1, out=rows)
        cells = rows.astype(np.int32) * table.shape[1] + columns.astype(np.int32)
        return np.asarray(table.ravel().take(cells))


def _log_likelihoods(grid: GridMap, settings: LocalisationSettings) -> Singles:
    """Return the logarithm of an echo's likelihood in each cell, with a margin of one cell that stands for all beyond.

    It falls off with the distance to the nearest face of an occupied cell, on both sides: there rays end.
    """
    from scipy.ndimage import distance_transform_edt

    solid = np.pad(grid.cells >= SOLID, 1)
    away = np.full(solid.shape, math.inf)
    if solid.any():
        away = distance_transform_edt(~solid) + distance_transform_edt(solid) - 0.5
    share = away * (grid.resolution / settings.sigma_hit)
    likelihoods = settings.hit * np.exp(-share * share / 2) + settings.random
    likelihoods[[0, -1]] = likelihoods[:, [0, -1]] = settings.random
    return np.log(likelihoods).astype(np.float32)


def _tempered(fits: Singles, priors: Array) -> Array:
    """Return weights with a sum of 1 by logarithms of likelihoods, and weights before.

    Echoes are not as independent as a product of their likelihoods takes them for. A scan that would leave too few
    particles effective, because none is near enough to the truth yet, is weighed by a smaller power of it.
    """
    below = (fits - fits.max()).astype(float)

    def weights(power: float) -> Array:
        found = priors * np.exp(power * below)
        return np.asarray(found / found.sum())

    found, low, high, least = weights(1.0), 0.0, 1.0, EFFECTIVE / float(priors @ priors)
    if 1 / (found @ found) >= least:
        return found
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        found = weights(middle)
        low, high = (middle, high) if 1 / (found @ found) >= least else (low, middle)
    return weights(low)


def _moved(poses: Array, x: Array | float, y: Array | float, turn: float, error: Array | float = 0.0) -> Array:
    """Return poses after a motion in the base, with an error of the heading that grows evenly on the way."""
    heading = poses[:, 2] + error / 2
    cos, sin = np.cos(heading), np.sin(heading)
    turned = _wrapped(poses[:, 2] + turn + error)
    return np.column_stack((poses[:, 0] + cos * x - sin * y, poses[:, 1] + sin * x + cos * y, turned))


def _wrapped(angles: Array) -> Array:
    """Return angles [rad] within (-pi, pi]."""
    return np.asarray(math.pi - np.remainder(math.pi - angles, math.tau))


def _bins(poses: Array) -> Ints:
    """Return the number of the bin of each pose."""
    x, y, turn = np.floor(poses / (BIN, BIN, TURN_BIN)).astype(np.int64).T
    return np.asarray((x * (1 << 20) + y) * (1 << 6) + turn)


def _clustered(poses: Array, weights: Array, before: Pose2 | None = None) -> Pose2:
    """Return the middle of the heaviest cluster; the one around the pose before, unless that is much lighter."""
    _, inverse = np.unique(_bins(poses), return_inverse=True)
    found, weight = _shifted(poses, weights, np.asarray(inverse == np.bincount(inverse, weights).argmax()))
    if before is not None and (members := _near(poses, before)).any():
        here, stays = _shifted(poses, weights, members)
        return here if LIGHTER * stays >= weight else found
    return found


def _shifted(poses: Array, weights: Array, members: Bools) -> tuple[Pose2, float]:
    """Return the middle of a cluster after some steps of mean shift from its first members, and its weight."""
    for _ in range(SHIFTS):
        share, turns = weights[members] / weights[members].sum(), poses[members, 2]
        x, y = (share @ poses[members, :2]).tolist()
        middle = Pose2(x, y, math.atan2(share @ np.sin(turns), share @ np.cos(turns)))
        members = _near(poses, middle)
    return middle, float(weights[members].sum())


def _near(poses: Array, middle: Pose2) -> Bools:
    """Return which poses are in the same cluster as its middle."""
    away = np.hypot(poses[:, 0] - middle.x, poses[:, 1] - middle.y)
    return np.asarray((away <= NEAR) & (np.abs(_wrapped(poses[:, 2] - middle.heading)) <= TURN_NEAR))
