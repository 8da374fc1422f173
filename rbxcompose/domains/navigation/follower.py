"""Following a way: regulated pure pursuit, after S. Macenski et al., Regulated Pure Pursuit for Robot Path Tracking
(Autonomous Robots 47, 2023)."""

from __future__ import annotations

import math
from enum import StrEnum

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import AT_REST, Pose2, Velocity2, wrap_angle
from rbxcompose.domains.bases.driving import GoToCore, GoToSettings
from rbxcompose.domains.navigation.costs import INSCRIBED, LayeredCosts
from rbxcompose.domains.navigation.planner import PlannedPath

ASIDE = math.radians(50)  # bearing of the way ahead above which the robot turns on the spot
ALIGNED = math.radians(10)  # below which it drives on after that
STRAIGHT = math.radians(2)  # bearing of what a robot that stands does not turn to any more
FORESEEN = 0.2  # [m] of the arc that are examined at least
SLACK = 0.01  # [m] to everything that a robot keeps, unless it is nearer already
TURNING = 0.002  # [m] that are left to everything while one with corners turns on the spot, which is exact
CALM = 0.1  # turn rate of a robot that hardly turns [rad/s]
NEARER = (1.0, 0.5, 0.25)  # shares of the look-ahead that are tried if the arc leads into something
SLOWEST = 0.25  # share of the speed that costs and curves leave
WALKS, REACTS = 0.8, 0.3  # [m/s] of people indoors, [s] until a scan has an effect
SEARCHED = 1.5  # [m] of the way ahead in which the robot's place on it is searched
IN_CORNER = 0.02  # [m] before a corner in which the robot turns on the spot that it is there
LAG = 0.1  # [s] from a pose until the command that follows from it has an effect
SETTLED = 2.5  # tolerances from the goal at which it is driven to directly


class FollowState(StrEnum):
    """What a follower does."""

    FOLLOWS = "follows"
    TURNS = "turns"
    ARRIVES = "arrives"
    BLOCKED = "blocked"
    STUCK = "stuck"
    REACHED = "reached"


@dataclass(frozen=True, slots=True)
class FollowerSettings:
    """How to drive along a way; all above zero."""

    speed: float = 0.4
    """Largest speed [m/s]."""
    turn_rate: float = math.radians(75)
    """Largest turn rate [rad/s]."""
    acceleration: float = 0.5
    """[m/s^2], also for braking."""
    turn_acceleration: float = 1.5
    """[rad/s^2]."""
    look_ahead: float = 0.5
    """How far ahead on the way the robot aims [m]."""
    curve: float = 0.6
    """Curves of a smaller radius are driven slower [m]."""
    foresight: float = 1.0
    """How far ahead it looks for obstacles on its arc [s], besides the time to stop."""
    tolerance: float = 0.1
    """How far from the goal the base may end [m]."""
    heading_tolerance: float = math.radians(5)
    """How far from the goal's heading it may end [rad]."""


class PathFollower:
    """Follows one way; `settings` may be replaced meanwhile."""

    def __init__(self, settings: FollowerSettings) -> None:
        self.settings = settings
        self.left = 0.0
        """Of the way, at the last update [m]."""
        self._path: PlannedPath | None = None
        self._at = 0
        self._speed = 0.0  # commanded [m/s]
        self._turn_rate = 0.0  # [rad/s]
        self._turns = False
        self._last: GoToCore | None = None  # drives the last piece
        self._until = 0.0  # [m] of the way to where it stops next
        self._corners: list[int] = []  # of the way, ahead
        self._is_narrow = False  # so that a robot which is no circle has no room to turn anywhere ahead

    def start(self, path: PlannedPath) -> None:
        """Follow another way from now on; the robot may be moving."""
        self._path, self._at, self._last = path, 0, None
        points = np.array([(pose.x, pose.y) for pose in path.poses])
        steps = np.hypot(*np.diff(points, axis=0).T)
        self._points, self._behind = points, np.concatenate(((0.0,), steps.cumsum()))
        self.left = float(self._behind[-1])
        turned = np.diff([pose.heading for pose in path.poses[:-1]])
        self._corners = (np.flatnonzero(np.abs(np.sin(turned / 2)) > math.sin(STRAIGHT / 2)) + 1).tolist()

    def update(self, pose: Pose2, costs: LayeredCosts, dt: float) -> tuple[Velocity2, FollowState]:
        """Return the velocity to command at a pose in `map`, and what the follower does; `dt` [s] since the last one.

        Raises:
            RuntimeError: if there is no way.
        """
        if self._path is None:
            raise RuntimeError("update was called before start")
        goal = self._path.poses[-1]
        corner = self._narrow_corner(pose, costs)
        self._advance(pose, corner)
        is_last = corner is None and not (self._is_narrow and self._corners)
        if self._last is None and is_last and pose.distance(goal) <= SETTLED * self.settings.tolerance:
            self._last = GoToCore(self._last_settings())
            self._last.start(goal)
        if self._last is not None:
            return self._arrive(self._last, pose, goal, costs, dt)
        if (velocity := self._advancing(pose, costs, dt, corner, ALIGNED if self._is_narrow else ASIDE)) is not None:
            return velocity, FollowState.FOLLOWS
        bearing = self._carrot(pose, NEARER[-1] * self.settings.look_ahead, corner)[1]
        self._turns = abs(bearing) > STRAIGHT or abs(self._turn_rate) > CALM
        if self._turns and (angle := self._turn_with_room(pose, bearing, costs)) is not None:
            if self._speed and costs.settings.outline is not None:
                return self._brake(costs, dt), FollowState.TURNS
            return self._turn(angle, dt), FollowState.TURNS
        self._turns = False
        if self._is_narrow and (velocity := self._advancing(pose, costs, dt, corner, ASIDE)) is not None:
            return velocity, FollowState.FOLLOWS
        return self._brake(costs, dt), FollowState.BLOCKED

    def _advancing(
        self, pose: Pose2, costs: LayeredCosts, dt: float, corner: int | None, most: float
    ) -> Velocity2 | None:
        """Command an arc to the way ahead, and return it; None if all lead into something, or turn first: by the
        bearing `most` [rad]."""
        for share in NEARER[-1:] if self._turns else NEARER:
            reach = share * self.settings.look_ahead
            away, bearing = self._carrot(pose, reach, corner)
            if abs(bearing) > (ALIGNED if self._turns else most):
                continue  # it turns first, unless nearer places on the way are ahead
            velocity = self._pursue(pose, away, bearing, costs, dt)
            if not self._hits(pose, velocity, costs, reach):
                self._turns = False
                self._speed, self._turn_rate = velocity.linear, velocity.angular
                return velocity
        return None

    def halt(self) -> None:
        """Know that the robot was stopped."""
        self._speed = self._turn_rate = 0.0

    def _last_settings(self) -> GoToSettings:
        limits = self.settings
        return GoToSettings(
            speed=min(limits.speed, 0.15),
            turn_rate=limits.turn_rate,
            deceleration=limits.acceleration,
            turn_deceleration=limits.turn_acceleration,
            distance_tolerance=limits.tolerance,
            heading_tolerance=limits.heading_tolerance,
        )

    def _arrive(
        self, last: GoToCore, pose: Pose2, goal: Pose2, costs: LayeredCosts, dt: float
    ) -> tuple[Velocity2, FollowState]:
        velocity, is_done = last.update(pose, dt)
        self.left = last.distance
        self._speed, self._turn_rate = velocity.linear, velocity.angular
        if is_done:
            return AT_REST, FollowState.REACHED
        if last.stuck:
            return self._brake(costs, dt), FollowState.STUCK
        if velocity.linear and self._hits(pose, velocity, costs, last.distance):
            return self._brake(costs, dt), FollowState.BLOCKED
        if velocity.angular and not velocity.linear:
            is_there = last.distance <= self.settings.tolerance
            short = wrap_angle(goal.heading - pose.heading) if is_there else pose.bearing(goal)
            if (angle := self._turn_with_room(pose, short, costs)) is None:
                return self._brake(costs, dt), FollowState.BLOCKED
            if angle != short:
                return self._turn(angle, dt), FollowState.ARRIVES
        return velocity, FollowState.ARRIVES

    def _narrow_corner(self, pose: Pose2, costs: LayeredCosts) -> int | None:
        """Return the place of the next corner of the way to which a robot that is no circle must keep exactly.

        From there on it has no room to turn for a while, so it turns in the corner itself.
        """
        self._is_narrow = False
        if (outline := costs.settings.outline) is None:
            return None
        ahead = self.settings.look_ahead + outline.reach
        limit = int(np.searchsorted(self._behind, self._behind[self._at] + ahead))
        self._is_narrow = costs.room_at(self._points[self._at : limit + 1]) < outline.reach + SLACK
        while self._corners and self._corners[0] <= limit:
            corner = self._corners[0]
            along = self._points[corner] - self._points[corner - 1]
            passed = float((pose.x, pose.y) @ along - self._points[corner] @ along) / math.hypot(*along)
            end = int(np.searchsorted(self._behind, self._behind[corner] + ahead)) + 1
            is_narrow = costs.room_at(self._points[corner:end]) < outline.reach + SLACK
            if self._at <= corner and passed < -IN_CORNER and is_narrow:
                return int(corner)
            if self._at < corner and not is_narrow:
                return None
            del self._corners[0]
            self._at = max(self._at, corner)
        return None

    def _advance(self, pose: Pose2, corner: int | None) -> None:
        """Find the place on the way that is nearest to the robot, from the last one on, and up to a corner."""
        end = int(np.searchsorted(self._behind, self._behind[self._at] + SEARCHED)) + 1
        if corner is not None:
            end = min(end, corner + 1)
        near = self._points[self._at : end]
        self._at += int(np.hypot(near[:, 0] - pose.x, near[:, 1] - pose.y).argmin())
        self.left = self._until = float(self._behind[-1] - self._behind[self._at])
        if corner is not None:
            self._until = math.dist((pose.x, pose.y), self._points[corner].tolist()) - IN_CORNER - LAG * self._speed

    def _carrot(self, pose: Pose2, reach: float, corner: int | None) -> tuple[float, float]:
        """Return how far the place on the way is that lies `reach` [m] ahead, and its bearing [rad].

        It is straight on behind a corner.
        """
        ahead = min(self._behind[self._at] + reach, self._behind[-1])
        x, y = (float(np.interp(ahead, self._behind, values)) for values in self._points.T)
        if corner is not None and ahead > self._behind[corner]:
            before, after = self._points[corner - 1 : corner + 1]
            x, y = after + (after - before) * ((ahead - self._behind[corner]) / math.dist(before, after))
        bearing = wrap_angle(math.atan2(y - pose.y, x - pose.x) - pose.heading)
        return max(math.hypot(x - pose.x, y - pose.y), 1e-6), bearing

    def _turn(self, bearing: float, dt: float) -> Velocity2:
        limits = self.settings
        rate = min(limits.turn_rate, math.sqrt(2 * limits.turn_acceleration * abs(bearing)))
        return self._command(0.0, math.copysign(rate, bearing), dt)

    def _turn_with_room(self, pose: Pose2, angle: float, costs: LayeredCosts) -> float | None:
        """Return by which angle to turn on the spot, as wanted or the other way around; None if there is no room.

        A robot that is round turns as it is wanted.
        """
        if costs.settings.outline is None:
            return angle
        for turn in (angle, angle - math.copysign(math.tau, angle)):
            if not costs.comes_nearer(pose, _swept(pose, turn, costs), TURNING):
                return turn
        return None

    def _pursue(self, pose: Pose2, away: float, bearing: float, costs: LayeredCosts, dt: float) -> Velocity2:
        """Return the velocity along the arc to a place; it is not commanded yet."""
        limits = self.settings
        curvature = 2 * math.sin(bearing) / away
        speed = self._zoned(pose, costs)
        if abs(curvature) * limits.curve > 1:
            speed = max(speed / (abs(curvature) * limits.curve), SLOWEST * speed)
        near = min(costs.value_at(pose.x, pose.y), INSCRIBED) / INSCRIBED
        speed *= 1 - (1 - SLOWEST) * near * near
        speed = min(speed, math.sqrt(2 * limits.acceleration * max(self._until, 0.0)) + 0.02)
        speed = min(speed, self._yields(pose, costs))
        if abs(speed * curvature) > limits.turn_rate:
            speed = limits.turn_rate / abs(curvature)
        speed = _near(speed, self._speed, limits.acceleration * dt)
        # Curves follow the speed: twice as much room for them.
        return Velocity2(speed, _near(speed * curvature, self._turn_rate, 2 * limits.turn_acceleration * dt))

    def _zoned(self, pose: Pose2, costs: LayeredCosts) -> float:
        """Return how fast the robot may be [m/s], so that it keeps the speed of its zone, and can brake to that of the
        next one before it is there."""
        limits = self.settings
        speed = limits.speed * costs.share_at(pose.x, pose.y)
        late = LAG * self._speed + costs.grid.resolution
        ahead = np.arange(0.0, late + self._speed**2 / (2 * limits.acceleration), costs.grid.resolution)
        x, y = (np.interp(self._behind[self._at] + ahead, self._behind, values) for values in self._points.T)
        for at, *place in zip(ahead.tolist(), x.tolist(), y.tolist(), strict=True):
            kept = limits.speed * costs.share_at(*place)
            speed = min(speed, math.sqrt(kept * kept + 2 * limits.acceleration * max(0.0, at - late)))
        return speed

    def _yields(self, pose: Pose2, costs: LayeredCosts) -> float:
        """Return how fast the robot may be [m/s], so that it stands when somebody ahead who walks up to it is there.

        He comes nearer by WALKS (REACTS + v / a), while the robot drives v REACTS + v^2 / 2a.
        """
        away = costs.moving - (pose.x, pose.y)
        ahead = away @ (math.cos(pose.heading), math.sin(pose.heading)) > 0
        if not ahead.any():
            return math.inf
        most, brakes = float(np.hypot(*away[ahead].T).min()) - costs.settings.reach, self.settings.acceleration
        time = REACTS + WALKS / brakes
        return brakes * (math.sqrt(time * time + 2 * max(most - WALKS * REACTS, 0.0) / brakes) - time)

    def _brake(self, costs: LayeredCosts, dt: float) -> Velocity2:
        """Return the velocity to command; one that has corners brakes along its arc, on which there is room for it."""
        if costs.settings.outline is None or not self._speed:
            return self._command(0.0, 0.0, dt)
        speed = _near(0.0, self._speed, self.settings.acceleration * dt)
        self._speed, self._turn_rate = speed, self._turn_rate * speed / self._speed
        return Velocity2(self._speed, self._turn_rate)

    def _command(self, speed: float, turn_rate: float, dt: float) -> Velocity2:
        """Return, as the one that is commanded, the velocity that is nearest to the wanted one."""
        limits = self.settings
        self._speed = _near(speed, self._speed, limits.acceleration * dt)
        self._turn_rate = _near(turn_rate, self._turn_rate, 2 * limits.turn_acceleration * dt)
        return Velocity2(self._speed, self._turn_rate)

    def _hits(self, pose: Pose2, velocity: Velocity2, costs: LayeredCosts, reach: float) -> bool:
        """Return whether the arc ahead leads too near to something; out of there it may lead."""
        time = self.settings.foresight + abs(velocity.linear) / self.settings.acceleration
        # The arc is meant up to where it meets the way again; `left` is exact to a cell.
        length = min(max(abs(velocity.linear) * time, FORESEEN), reach, self._until - costs.grid.resolution)
        moved = length
        if costs.settings.outline is not None:
            length = max(length, velocity.linear**2 / (2 * self.settings.acceleration))
            moved = max(length, length * abs(velocity.angular / (velocity.linear or 1.0)) * costs.settings.reach)
        lasts = length / max(abs(velocity.linear), 1e-9)
        count = max(0, math.ceil(moved / costs.grid.resolution))
        times = lasts * np.arange(1, count + 1) / max(1, count)
        return costs.comes_nearer(pose, _arc(pose, velocity, times), SLACK)


def _near(wanted: float, now: float, change: float) -> float:
    """Return the value that is nearest to a wanted one, at most a change away from that of now."""
    return min(max(wanted, now - change), now + change)


def _arc(pose: Pose2, velocity: Velocity2, times: Array) -> Array:
    """Return where a robot is after some times [s]: poses (n, 3) in `map` [m], [rad]."""
    half = velocity.angular * times / 2
    chord, along = velocity.linear * times * np.sinc(half / math.pi), pose.heading + half
    return np.stack((pose.x + chord * np.cos(along), pose.y + chord * np.sin(along), along + half), -1)


def _swept(pose: Pose2, angle: float, costs: LayeredCosts) -> Array:
    """Return poses (n, 3) during a turn on the spot between which no point of the robot moves by more than a cell."""
    count = max(1, math.ceil(abs(angle) * costs.settings.reach / costs.grid.resolution))
    headings = pose.heading + angle * np.arange(1, count + 1) / count
    return np.column_stack((np.full(count, pose.x), np.full(count, pose.y), headings))
