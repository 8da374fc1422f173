"""Driving in front of a tag, to face it squarely: to a point farther out on its normal, straight in, and a last turn.

The tag is remembered in a frame that moves little, such as odometry, so that it need not be seen all the time.
"""

from __future__ import annotations

import math
from enum import StrEnum

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import AT_REST, Pose2, Velocity2, wrap_angle
from rbxcompose.domains.bases.driving import GoToCore, GoToSettings

NEAR, FAR = 0.005, 0.02  # [m, m/m^2] by which a tag is seen elsewhere: at once, and for each square metre of distance
DOUBTED = 0.02  # weight of a normal that is not known
FORGETS = 4.0  # [s] after which half of what was seen counts no more, as odometry drifts
SURE = 3  # pictures after which it drives to where a tag is
MOVED = 0.05  # [m] by which a tag is elsewhere than believed, after which it sets out anew
ONTO = 0.25  # [m] ahead at which it aims along the normal
TURNS = 3.0  # turn rate for an error of the heading [1/s]
ENTRY = 0.05  # [m] beside the normal at most when it drives in
SLOWEST = 0.02  # [m/s] of the way in
SPINS = 1.1 * math.tau  # [rad] that it turns at most in search of the tag


class DockingState(StrEnum):
    """What it does."""

    SEARCHES = "searches"
    STAGES = "stages"
    APPROACHES = "approaches"
    TURNS = "turns"
    RETREATS = "retreats"
    DOCKED = "docked"
    NOT_SEEN = "not_seen"
    LOST = "lost"
    STUCK = "stuck"
    MISSED = "missed"


OVER = (DockingState.DOCKED, DockingState.NOT_SEEN, DockingState.LOST, DockingState.STUCK, DockingState.MISSED)


@dataclass(frozen=True, slots=True)
class DockingSettings:
    """How to dock; all above zero."""

    distance: float = 0.4
    """From the middle of the robot to the tag in the end [m]."""
    room: float = 0.5
    """Before that, from which it drives straight in [m]."""
    speed: float = 0.3
    """To that point [m/s]."""
    slow: float = 0.1
    """Straight in [m/s]."""
    turn_rate: float = 1.0
    """[rad/s]."""
    deceleration: float = 0.5
    """[m/s^2]."""
    tolerance: float = 0.02
    """By which its place may be off in the end [m]."""
    heading_tolerance: float = math.radians(2)
    """By which its heading may be off [rad]."""
    patience: float = 5.0
    """Without the tag [s]."""
    tries: int = 3
    """Times that it drives in before it has missed."""


class DockPlace:
    """Where a tag is, seen from above: a weighted mean of what was seen."""

    def __init__(self) -> None:
        self.count = 0
        self._time = 0.0
        self._weight = self._turned = 0.0  # of the place, and of the normal
        self._x = self._y = 0.0
        self._cos = self._sin = 0.0

    @property
    def pose(self) -> Pose2 | None:
        """Return its place, and the direction of its normal; None until it has been seen often enough."""
        if self.count < SURE:
            return None
        return Pose2(self._x, self._y, math.atan2(self._sin, self._cos))

    def see(self, seen: Pose2, away: float, time: float, *, is_square: bool) -> None:
        """Take where it is seen from a distance [m] at a time [s], with the direction of its normal.

        If that is not known (not `is_square`), it is taken to look at who sees it: a tag is in doubt only if it does,
        more or less.
        """
        faded = 0.5 ** (max(0.0, time - self._time) / FORGETS)
        self._time = time
        if self.count and math.hypot(seen.x - self._x, seen.y - self._y) > MOVED + FAR * away * away * 4:
            self.count, faded = 0, 0.0  # somebody has moved it, or the odometry has jumped
        weight = 1.0 / (NEAR + FAR * away * away) ** 2
        self._weight, self._turned = self._weight * faded, self._turned * faded
        share = weight / (self._weight + weight)
        self._x, self._y = self._x + share * (seen.x - self._x), self._y + share * (seen.y - self._y)
        self._weight, self.count = self._weight + weight, self.count + 1
        weight *= 1.0 if is_square else DOUBTED
        share = weight / (self._turned + weight)
        self._cos += share * (math.cos(seen.heading) - self._cos)
        self._sin += share * (math.sin(seen.heading) - self._sin)
        self._turned += weight


class Docking:
    """One drive to a tag."""

    def __init__(self, settings: DockingSettings, time: float) -> None:
        """Begin at a time [s]."""
        self.settings, self.place, self.state = settings, DockPlace(), DockingState.SEARCHES
        limits = GoToSettings(settings.speed, settings.turn_rate, settings.deceleration, distance_tolerance=0.02)
        self._driver, self._staging = GoToCore(limits), Pose2()
        self._seen, self._tries, self._searched = time, 0, 0.0
        self._last: Pose2 | None = None
        self._idle = 0.0

    @property
    def goal(self) -> Pose2 | None:
        """Return the pose at which it is docked, as far as that is known."""
        return self._before(self.settings.distance)

    def error(self, base: Pose2) -> tuple[float, float, float]:
        """Return the distance to the tag [m], how far the base is to the left of the tag's normal [m], and by how much
        it is turned to the left of facing the tag [rad]."""
        tag = self.place.pose or Pose2()
        dx, dy = base.x - tag.x, base.y - tag.y
        cos, sin = math.cos(tag.heading), math.sin(tag.heading)
        return dx * cos + dy * sin, dx * sin - dy * cos, wrap_angle(base.heading - tag.heading - math.pi)

    def see(self, seen: Pose2, away: float, time: float, *, is_square: bool) -> None:
        """Take where the tag is seen, as `DockPlace.see` does."""
        self.place.see(seen, away, time, is_square=is_square)
        self._seen = time

    def update(self, base: Pose2, time: float, dt: float) -> Velocity2:
        """Return the velocity to command at a pose at a time [s], `dt` [s] after the last one."""
        self._watch(base, dt)
        if self.state is DockingState.STAGES:
            self._seen = time  # on that way it may look elsewhere
        if self.state not in OVER and time - self._seen > self.settings.patience:
            unseen = self.goal is None
            if unseen and self._searched < SPINS:
                return self._search(base, dt)
            self.state = DockingState.NOT_SEEN if unseen else DockingState.LOST
        if self.state in OVER:
            return AT_REST
        if self.goal is None:
            return self._search(base, dt) if time - self._seen > 1.0 else AT_REST
        if self.state in (DockingState.SEARCHES, DockingState.RETREATS):
            self._stage()
        if self.state is DockingState.STAGES:
            return self._to_staging(base, dt)
        return self._in(base) if self.state is DockingState.APPROACHES else self._turn(base)

    def _before(self, distance: float) -> Pose2 | None:
        if (tag := self.place.pose) is None:
            return None
        x, y = tag.x + distance * math.cos(tag.heading), tag.y + distance * math.sin(tag.heading)
        return Pose2(x, y, wrap_angle(tag.heading + math.pi))

    def _search(self, base: Pose2, dt: float) -> Velocity2:
        self.state = DockingState.SEARCHES
        rate = self.settings.turn_rate / 2
        self._searched += rate * dt
        return Velocity2(0.0, rate)

    def _stage(self) -> None:
        self._staging = self._before(self.settings.distance + self.settings.room) or Pose2()
        self._driver.start(self._staging)
        self.state = DockingState.STAGES

    def _to_staging(self, base: Pose2, dt: float) -> Velocity2:
        wanted = self._before(self.settings.distance + self.settings.room) or self._staging
        turned = abs(wrap_angle(wanted.heading - self._staging.heading))
        if wanted.distance(self._staging) > MOVED or turned > self.settings.heading_tolerance * 2:
            self._stage()
        distance, aside, turned = self.error(base)
        is_before = self.settings.distance < distance < self.settings.distance + self.settings.room + MOVED
        if is_before and abs(aside) < ENTRY * 0.6 and abs(turned) < self.settings.heading_tolerance * 4:
            self.state = DockingState.APPROACHES
            return AT_REST
        velocity, is_there = self._driver.update(base, dt)
        if is_there:
            self.state = DockingState.APPROACHES
        return velocity

    def _in(self, base: Pose2) -> Velocity2:
        settings = self.settings
        distance, aside, turned = self.error(base)
        left = distance - settings.distance
        if left <= settings.tolerance / 4:
            self.state = DockingState.TURNS
            return AT_REST
        if abs(aside) > ENTRY + left * 0.2:
            self.state = DockingState.RETREATS
            return self._again()
        speed = min(settings.slow, max(SLOWEST, math.sqrt(2 * settings.deceleration * left) / 2))
        # The base looks at the tag: what is to the left of the normal for it, is to its right for the tag.
        wanted = -math.atan2(aside, ONTO)
        rate = max(-settings.turn_rate, min(settings.turn_rate, TURNS * wrap_angle(wanted - turned)))
        return Velocity2(speed * math.cos(turned), rate)

    def _turn(self, base: Pose2) -> Velocity2:
        distance, aside, turned = self.error(base)
        if abs(turned) > self.settings.heading_tolerance / 2:
            rate = max(min(abs(turned) * TURNS / 2, self.settings.turn_rate), 0.05)
            return Velocity2(0.0, -math.copysign(rate, turned))
        if math.hypot(distance - self.settings.distance, aside) > self.settings.tolerance:
            return self._again()
        self.state = DockingState.DOCKED
        return AT_REST

    def _again(self) -> Velocity2:
        """Set out from farther away once more."""
        self._tries += 1
        self.state = DockingState.MISSED if self._tries >= self.settings.tries else DockingState.RETREATS
        return AT_REST

    def _watch(self, base: Pose2, dt: float) -> None:
        """Notice if the base does not move."""
        before, self._last = self._last, base
        moves = before is not None and (
            before.distance(base) > 0.002 * dt / 0.05 or abs(wrap_angle(base.heading - before.heading)) > 0.002
        )
        self._idle = 0.0 if moves or self.goal is None else self._idle + dt
        if self._idle > self.settings.patience and self.state not in OVER:
            self.state = DockingState.STUCK
