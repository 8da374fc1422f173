"""Driving after a person: at a distance while that is seen, then to where it was last seen.

The way leads to a place before the person, as in Nav2's dynamic object following
(https://docs.nav2.org/tutorials/docs/navigation2_dynamic_point_following.html): straight if nothing is in between, else
planned, else along the person's own trail, which was free when somebody walked there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum

from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import AT_REST, Pose2, Velocity2
from rbxcompose.domains.bases.driving import GoToCore, GoToSettings
from rbxcompose.domains.navigation.costs import LayeredCosts
from rbxcompose.domains.navigation.follower import FollowerSettings, FollowState, PathFollower
from rbxcompose.domains.navigation.people import TrackedPerson
from rbxcompose.domains.navigation.planner import NoPathError, PlannedPath, plan

AHEAD = math.radians(60)  # to each side of the robot, in which it looks for whom to follow
SURE = 0.9  # reliability of somebody who has moved
AGAIN = 0.4  # [s] between two ways
STARTS = 0.2  # [m] beyond the distance at which a robot that stands drives on
FACED, ASIDE = math.radians(5), math.radians(15)  # bearings at which it stops turning, and begins to
PATIENT = 0.6  # [s] since the person was seen, in which it still is where it should be
WALKS = 1.5  # [m/s] at most, of somebody who is found again
NEAR = 0.5  # [m] from where the person was last seen that are as good as there
SEARCHED = 20.0  # [s] on the way there at most
HELD = 15.0  # [s] without a way to a person who is seen
ROOM = 0.2  # [m] to both sides of a straight way; where there is less, the planner knows a better one
STRAYS, STRAYS_ON = 0.5, 0.3  # [m] and [m/s] from where somebody walked on to, of whoever stands there now
WALKS_ON = 3.0  # [s] for which somebody out of sight is believed to walk on
TRAIL, TRAIL_STEP = 40, 0.2  # places and [m] between two of them


class CompanionState(StrEnum):
    """What it does; the last two are its ends."""

    FOLLOWS = "follows"
    STANDS = "stands"
    SEARCHES = "searches"
    WAITS = "waits"
    LOST = "lost"
    BLOCKED = "blocked"


class PersonCompanion:
    """Follows one person."""

    def __init__(
        self,
        driving: FollowerSettings,
        distance: float,
        patience: float,
        target: TrackedPerson,
        others: Sequence[TrackedPerson] = (),
    ) -> None:
        """Follow a person, and none of the others who are seen now.

        Keep a `distance` [m] between the middles of robot and person; be patient at the place where it was seen last
        for a time [s].
        """
        self._driving, self._keeps, self._patience = driving, distance, patience
        self.target = target
        """As it was last seen."""
        self.state = CompanionState.STANDS
        self._known = {one.name for one in others} - {target.name}
        self._trail = [(target.x, target.y)]
        self._path: PathFollower | None = None
        self._follower = PathFollower(driving)
        self._turner: GoToCore | None = None
        self._seen = -math.inf  # [s], as those below
        self._planned = -math.inf
        self._free = -math.inf  # when there was a way last, or none was needed
        self._searches: float | None = None  # since then
        self._waits: float | None = None  # since then

    def distance(self, pose: Pose2) -> float:
        """Return how far the person is, or was when it was last seen [m]."""
        return math.hypot(self.target.x - pose.x, self.target.y - pose.y)

    def halt(self) -> None:
        """Know that the robot was stopped."""
        self._follower.halt()
        self._path = self._turner = None

    def update(
        self, now: float, dt: float, pose: Pose2, people: Sequence[TrackedPerson], costs: LayeredCosts
    ) -> Velocity2:
        """Return the velocity to command at a pose in the fixed frame at a time [s], `dt` [s] after the last one; the
        state says what that is for."""
        if self._seen == -math.inf:
            self._seen = self._free = now
        found = self._find(now, people)
        if found is not None:
            self.target, self._seen, self._searches, self._waits = found, now, None, None
            if math.dist(self._trail[-1], (found.x, found.y)) > TRAIL_STEP:
                self._trail = [*self._trail[1 - TRAIL :], (found.x, found.y)]
        if now - self._seen <= PATIENT:
            return self._keep_distance(now, dt, pose, costs)
        return self._search(now, dt, pose, costs)

    def _find(self, now: float, people: Sequence[TrackedPerson]) -> TrackedPerson | None:
        """Return the person, also under a new name: who appears where it may have walked, and was not there before."""
        by_name = {one.name: one for one in people}
        if (same := by_name.get(self.target.name)) is not None:
            self._known |= by_name.keys() - {same.name}
            return same
        gone = now - self._seen
        new = [one for one in people if one.name not in self._known]
        moving = [one for one in new if one.reliability >= SURE and self._away(one) <= STRAYS + WALKS * gone]
        if moving:
            return min(moving, key=self._away)
        standing = [one for one in new if self._aside(one, min(gone, WALKS_ON)) <= STRAYS + STRAYS_ON * gone]
        return min(standing, key=lambda one: self._aside(one, gone), default=None)

    def _away(self, one: TrackedPerson) -> float:
        return math.hypot(one.x - self.target.x, one.y - self.target.y)

    def _aside(self, one: TrackedPerson, gone: float) -> float:
        """Return how far somebody is from the line on which the person would have walked on for a time [s]."""
        x, y, target = one.x - self.target.x, one.y - self.target.y, self.target
        part = (x * target.vx + y * target.vy) / max(target.speed**2, 1e-9)
        part = min(max(part, 0.0), gone)
        return math.hypot(x - part * target.vx, y - part * target.vy)

    def _keep_distance(self, now: float, dt: float, pose: Pose2, costs: LayeredCosts) -> Velocity2:
        keeps, away = self._keeps, self.distance(pose)
        if away <= keeps + (0.0 if self._path is not None else STARTS):
            self._free = now
            return self._stand(dt, pose, CompanionState.STANDS)
        if now - self._planned >= AGAIN:
            self._planned = now
            self._aim(self._way_to_person(pose, costs))
        velocity = self._drive(dt, pose, costs)
        if velocity is not None:
            self._free = now
            self.state = CompanionState.FOLLOWS
            return velocity
        velocity = self._stand(dt, pose, CompanionState.STANDS)
        if now - self._free > HELD:
            self.state = CompanionState.BLOCKED
        return velocity

    def _search(self, now: float, dt: float, pose: Pose2, costs: LayeredCosts) -> Velocity2:
        """Drive to where the person was last seen, and wait there."""
        if self._searches is None:
            self._searches, self._planned, self._path = now, -math.inf, None
        if self._waits is None:
            there = Pose2(self.target.x, self.target.y, math.atan2(self.target.y - pose.y, self.target.x - pose.x))
            if now - self._planned >= AGAIN and self._path is None:
                self._planned = now
                try:
                    self._aim(plan(costs, pose, there, NEAR))
                except NoPathError:
                    self._waits = now
            velocity = self._drive(dt, pose, costs)
            is_there = self.distance(pose) <= self._driving.tolerance
            if velocity is not None and not is_there and now - self._searches < SEARCHED:
                self.state = CompanionState.SEARCHES
                return velocity
            has_ended = self.distance(pose) <= NEAR  # the way, near to where the person was
            if is_there or now - self._searches >= SEARCHED or has_ended:
                self._waits = now
        velocity = self._stand(dt, pose, CompanionState.WAITS)
        if self._waits is not None and now - self._waits >= self._patience:
            self.state = CompanionState.LOST
        return velocity

    def _way_to_person(self, pose: Pose2, costs: LayeredCosts) -> PlannedPath | None:
        """Return a way to a place before the person, None if there is none."""
        keeps, away = self._keeps, self.distance(pose)
        share = (away - keeps) / away
        x, y = pose.x + (self.target.x - pose.x) * share, pose.y + (self.target.y - pose.y) * share
        facing = math.atan2(self.target.y - pose.y, self.target.x - pose.x)
        count = max(2, math.ceil(math.hypot(x - pose.x, y - pose.y) / costs.grid.resolution) + 1)
        points = np.stack((np.linspace(pose.x, x, count), np.linspace(pose.y, y, count)), -1)
        if costs.clearance(np.column_stack((points, np.full(count, facing)))) >= ROOM:
            return PlannedPath(tuple(Pose2(at_x, at_y, facing) for at_x, at_y in points.tolist()))
        behind = [one for one in reversed(self._trail) if math.dist(one, (self.target.x, self.target.y)) >= keeps]
        for to_x, to_y in ((x, y), *behind[:1]):
            heading = math.atan2(self.target.y - to_y, self.target.x - to_x)
            try:
                return plan(costs, pose, Pose2(to_x, to_y, heading), NEAR)
            except NoPathError:
                continue
        return None

    def _aim(self, path: PlannedPath | None) -> None:
        """Drive along another way from now on."""
        self._path = self._turner = None
        if path is not None and len(path.poses) > 1:
            self._follower.start(path)
            self._path = self._follower

    def _drive(self, dt: float, pose: Pose2, costs: LayeredCosts) -> Velocity2 | None:
        """Return the velocity along the way; None if there is none, or it has ended."""
        if self._path is None:
            return None
        velocity, state = self._path.update(pose, costs, dt)
        if state in (FollowState.BLOCKED, FollowState.STUCK, FollowState.REACHED):
            self._path = None
            return None
        return velocity

    def _stand(self, dt: float, pose: Pose2, state: CompanionState) -> Velocity2:
        """Turn on the spot to see the person."""
        self.state, self._path = state, None
        self._follower.halt()
        facing = math.atan2(self.target.y - pose.y, self.target.x - pose.x)
        if self.distance(pose) < NEAR / 2:  # where it was: it looks where it went
            facing = math.atan2(self.target.vy, self.target.vx) if self.target.speed > 0.1 else pose.heading
        at = Pose2(pose.x, pose.y, facing)
        error = abs(pose.bearing(Pose2(pose.x + math.cos(facing), pose.y + math.sin(facing))))
        if self._turner is None:
            if error < ASIDE:
                return AT_REST
            limits = self._driving
            turning = GoToSettings(limits.speed, limits.turn_rate, turn_deceleration=limits.turn_acceleration)
            self._turner = GoToCore(turning)
        elif error < FACED:
            self._turner = None
            return AT_REST
        self._turner.start(at)
        velocity, _ = self._turner.update(pose, dt)
        return Velocity2(0.0, velocity.angular)


def whom_to_follow(pose: Pose2, people: Sequence[TrackedPerson]) -> TrackedPerson | None:
    """Return the nearest person ahead of a robot at a pose in the fixed frame; what may be a plant counts as twice as
    far."""

    def away(one: TrackedPerson) -> float:
        return math.hypot(one.x - pose.x, one.y - pose.y) / max(one.reliability, 0.1)

    ahead = [one for one in people if abs(pose.bearing(Pose2(one.x, one.y))) <= AHEAD]
    return min(ahead, key=away, default=None)
