"""Driving in front of a tag, to face it squarely: to a point farther out on its normal, straight in, and a last turn.

The tag is remembered in a frame that moves little, such as odometry, so that it need not be seen all the time.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import AT_REST, Pose2, Transform3, Velocity2, rotate, wrap_angle
from rbxcompose.base.levels import Level
from rbxcompose.base.units import LENGTH, TIME
from rbxcompose.domains.bases.driving import BaseDriver, GoToCore, GoToSettings
from rbxcompose.domains.vision.tag_watcher import SQUARE, TagWatcher, TagWatcherConfig, WatchedTag
from rbxcompose.msgs.rbxcompose_msgs import DockAt

SILENCE = 1.0  # [s] without anything from the camera, after which it stands
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
DECELERATION = 0.5  # [m/s^2]
TRIES = 3  # times that it drives in before it has missed


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
ENDS = {str(state): "failure" for state in OVER if state is not DockingState.DOCKED}
ServedDock = sdk.ServedGoal[DockAt.Goal, DockAt.Result, DockAt.Feedback]


class TagDockingConfig(TagWatcherConfig):
    """How it docks."""

    distance: Annotated[sdk.Length, sdk.Live()] = Field(0.4, gt=0)
    """From the middle of the robot to the tag in the end, unless a goal says otherwise."""
    room: Annotated[sdk.Length, sdk.Live()] = Field(0.5, gt=0)
    """Before that, from which it drives straight in."""
    speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.3, gt=0)
    """Largest speed to that point."""
    slow: Annotated[sdk.Speed, sdk.Live()] = Field(0.1, gt=0)
    """Largest speed straight in."""
    turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(math.radians(60), gt=0)
    """Largest turn rate."""
    tolerance: Annotated[sdk.Length, sdk.Live()] = Field(0.02, gt=0)
    """By which its place may be off in the end."""
    turn_tolerance: Annotated[sdk.Angle, sdk.Live()] = Field(math.radians(2), gt=0)
    """By which its heading may be off."""
    patience: Annotated[sdk.Time, sdk.Live()] = Field(5.0, gt=0)
    """Without the tag, unless a goal says otherwise."""


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

    def __init__(self, settings: TagDockingConfig, time: float) -> None:
        """Begin at a time [s]."""
        self.settings, self.place, self.state = settings, DockPlace(), DockingState.SEARCHES
        limits = GoToSettings(settings.speed, settings.turn_rate, DECELERATION, distance_tolerance=0.02)
        self._driver, self._staging = GoToCore(limits), Pose2()
        self._seen, self._tries, self._searched = time, 0, 0.0
        self._staged = time  # when it was last on its way to where it drives in
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
            self._staged = time  # on that way it may look elsewhere
        if self.state not in OVER and time - max(self._seen, self._staged) > self.settings.patience:
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
        if self._is_blind:
            return AT_REST
        return self._in(base) if self.state is DockingState.APPROACHES else self._turn(base)

    @property
    def _is_blind(self) -> bool:
        """Return whether it has not seen the tag since it came to where it drives in."""
        return self.state is DockingState.APPROACHES and self._seen <= self._staged

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
        if wanted.distance(self._staging) > MOVED or turned > self.settings.turn_tolerance * 2:
            self._stage()
        distance, aside, turned = self.error(base)
        is_before = self.settings.distance < distance < self.settings.distance + self.settings.room + MOVED
        if is_before and abs(aside) < ENTRY * 0.6 and abs(turned) < self.settings.turn_tolerance * 4:
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
        speed = min(settings.slow, max(SLOWEST, math.sqrt(2 * DECELERATION * left) / 2))
        # The base looks at the tag: what is to the left of the normal for it, is to its right for the tag.
        wanted = -math.atan2(aside, ONTO)
        rate = max(-settings.turn_rate, min(settings.turn_rate, TURNS * wrap_angle(wanted - turned)))
        return Velocity2(speed * math.cos(turned), rate)

    def _turn(self, base: Pose2) -> Velocity2:
        distance, aside, turned = self.error(base)
        if abs(turned) > self.settings.turn_tolerance / 2:
            rate = max(min(abs(turned) * TURNS / 2, self.settings.turn_rate), 0.05)
            return Velocity2(0.0, -math.copysign(rate, turned))
        if math.hypot(distance - self.settings.distance, aside) > self.settings.tolerance:
            return self._again()
        self.state = DockingState.DOCKED
        return AT_REST

    def _again(self) -> Velocity2:
        """Set out from farther away once more."""
        self._tries += 1
        self.state = DockingState.MISSED if self._tries >= TRIES else DockingState.RETREATS
        return AT_REST

    def _watch(self, base: Pose2, dt: float) -> None:
        """Notice if the base does not move."""
        before, self._last = self._last, base
        moves = before is not None and (
            before.distance(base) > 0.002 * dt / 0.05 or abs(wrap_angle(base.heading - before.heading)) > 0.002
        )
        self._idle = 0.0 if moves or self.goal is None or self._is_blind else self._idle + dt
        if self._idle > self.settings.patience and self.state not in OVER:
            self.state = DockingState.STUCK


@sdk.component("tag_docking")
class TagDocking(BaseDriver[TagDockingConfig], TagWatcher[TagDockingConfig]):
    """Drives in front of a tag or a board, and faces it squarely.

    It turns around if it does not see the tag, drives to a point on its normal, and straight in. Between pictures it
    goes by odometry. It sees no obstacles.

    Example:
        dock_at: {type: tag_docking, frame: camera_optical_frame, connect: {cmd_vel: cmd_vel/docking}}
    """

    rate = 20.0
    steps_for_goals = True
    dock = sdk.ServesAction(
        DockAt, "dock_at", claims="base", outcomes=ENDS, measures={"distance": LENGTH, "patience": TIME}
    )

    def configure(self) -> None:
        """Dock at nothing yet."""
        super().configure()
        self.goal: ServedDock | None = None
        self.docking: Docking | None = None
        self.chosen: Transform3 | None = None  # where the tag was seen last: of two with one name, that one is meant

    def accept_dock(self, goal: DockAt.Goal) -> str:
        """Refuse what names no tag, or is no distance or time."""
        fine = all(0.0 <= number < math.inf for number in (goal.distance, goal.patience))
        return "" if fine and goal.tag else "it names no tag, or its distance or patience is not finite, or below 0"

    def see(self, tags: list[WatchedTag]) -> None:
        """Note where the tag is."""
        if self.goal is None or self.docking is None:
            return
        mine = [tag for tag in tags if self.goal.request.tag in tag.names]
        last = self.chosen
        if mine:
            tag = min(mine, key=lambda one: math.dist(one.pose.translation, last.translation) if last else one.away)
            self.chosen = tag.pose
            x, y, up = rotate(tag.pose.rotation, (0.0, 0.0, 1.0))
            is_square = tag.score >= SQUARE and abs(up) < math.sin(math.radians(60))  # one that lies has no normal
            if not is_square and (base := self.bound["base"].now()) is not None:
                x, y = base.x - tag.pose.translation[0], base.y - tag.pose.translation[1]
            place = Pose2(*tag.pose.translation[:2], math.atan2(y, x))
            self.docking.see(place, tag.away, self.now, is_square=is_square)

    def step(self, dt: float) -> None:
        """Drive for one cycle, and end the goal if it is over."""
        goal, config = self.dock.current, self.config
        if goal is not self.goal:
            if goal is None:
                self.drive(AT_REST)
            self.goal, self.docking, self.chosen = goal, None, None
        if goal is None:
            return
        if goal.cancel_requested:
            self.drive(AT_REST)
            goal.canceled()
            return
        if self.docking is None:
            request = goal.request
            asked = {"distance": request.distance or config.distance, "patience": request.patience or config.patience}
            self.docking = Docking(config.model_copy(update=asked), self.now)
        self.take_tags()
        trouble = self.trouble(SILENCE)
        self.status(Level.WARN if trouble else Level.OK, trouble or str(self.docking.state))
        if (base := self.bound["base"].now()) is None:
            self.drive(AT_REST)
            return
        velocity = self.docking.update(base, self.now, dt)
        self.drive(AT_REST if self.silent > SILENCE else velocity)
        self.judge(goal, self.docking, base, trouble)

    def judge(self, goal: ServedDock, docking: Docking, base: Pose2, trouble: str) -> None:
        """End a goal that is over, or tell how far it is."""
        state = docking.state
        distance, aside, angle = docking.error(base) if docking.goal else (math.nan,) * 3
        if state is DockingState.DOCKED:
            goal.succeeded(DockAt.Result(distance=distance, aside=aside, angle=angle))
        elif state in OVER:
            words = {
                DockingState.NOT_SEEN: f"'{goal.request.tag}' was seen nowhere around",
                DockingState.LOST: f"'{goal.request.tag}' was lost on the way in",
                DockingState.STUCK: "the base does not move",
                DockingState.MISSED: f"{TRIES} times it came in beside the tag",
            }
            why = f"{words[state]}: {trouble}" if trouble else words[state]
            goal.aborted(f"{state}: {why}", DockAt.Result(str(state), why, distance, aside, angle))
        else:
            left = base.distance(docking.goal) if docking.goal else math.nan
            goal.feedback(DockAt.Feedback(str(state), left))
            return
        self.drive(AT_REST)

    def hold(self) -> None:
        """Command a halt: no step follows while robot time stands still."""
        if self.goal is not None:
            self.drive(AT_REST)

    def stop(self) -> None:
        """Command a halt."""
        self.drive(AT_REST)
