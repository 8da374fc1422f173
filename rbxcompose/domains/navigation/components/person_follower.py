"""Driving after a person."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import AT_REST, Pose2
from rbxcompose.base.units import LENGTH, TIME
from rbxcompose.domains.bases.driving import BaseDriver
from rbxcompose.domains.navigation.companion import CompanionState, PersonCompanion, whom_to_follow
from rbxcompose.domains.navigation.costs import CostSettings, CostZone, LayeredCosts
from rbxcompose.domains.navigation.follower import FollowerSettings
from rbxcompose.domains.navigation.localiser import STALE
from rbxcompose.domains.navigation.people import TrackedPerson
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.shapes import PolygonFootprint
from rbxcompose.domains.worlds.world import MAP_FRAME, grid_of
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.nav_msgs import OccupancyGrid
from rbxcompose.msgs.people_msgs import People
from rbxcompose.msgs.poses import pose_in
from rbxcompose.msgs.rbxcompose_msgs import FollowPerson
from rbxcompose.msgs.sensor_arrays import level_rays
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.sdk.bound import NewestMessage
from rbxcompose.sdk.ports import BULK

BLANK, CELL = 16.0, 0.05  # [m] sides of the area around a robot without a map, and of its cells
NOBODY = "nobody"
RECENT = 0.5  # [s] since people were told, up to which that counts
AT_PLACE, STILL, STANDS = 1.0, 0.2, 2.0  # [m] from a place, [m/s], [s]: somebody stands still there
ServedPerson = sdk.ServedGoal[FollowPerson.Goal, FollowPerson.Result, FollowPerson.Feedback]


class PersonFollowerConfig(sdk.Config):
    """How the robot follows somebody, and how much room it needs."""

    distance: Annotated[sdk.Length, sdk.Live()] = Field(1.0, gt=0)
    """Between the middles of the robot and of the person, unless a goal says otherwise."""
    patience: Annotated[sdk.Time, sdk.Live()] = Field(5.0, gt=0)
    """At the place where the person was last seen, unless a goal says otherwise."""
    scan: TopicName = "scan"
    """Topic of the laser that sees obstacles."""
    frame: str = "laser_link"
    """The frame of the laser."""
    stands_in: str = Field(MAP_FRAME, min_length=1)
    """The frame in which people are: `map`, or `odom` for a robot without a map."""
    sees: sdk.Length = Field(3.0, gt=0)
    """Up to here, obstacles count."""
    silence: sdk.Time = Field(1.0, gt=0)
    """Without a scan for so long, the robot stops."""
    radius: sdk.Length = Field(0.2, gt=0)
    """Radius of the robot seen from above, or of the circle that it covers."""
    corners: tuple[tuple[float, float], ...] = ()
    """Of a robot that is no circle, around its origin [m]."""
    inflation: sdk.Length = Field(0.45, gt=0)
    """Up to this distance from obstacles, ways are dearer."""
    zones: tuple[tuple[str, tuple[tuple[float, float], ...], float], ...] = ()
    """Name, corners [m] and share of the speed of each zone; a share of 0 keeps out."""
    speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.4, gt=0)
    """Largest speed."""
    turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(math.radians(75), gt=0)
    """Largest turn rate."""
    acceleration: Annotated[sdk.Acceleration, sdk.Live()] = Field(0.5, gt=0)
    """Acceleration, also for braking."""


@sdk.component("person_follower")
class PersonFollower(BaseDriver[PersonFollowerConfig]):
    """Drives after the person who is nearest ahead when a goal begins, around what the map and its laser show.

    It keeps a distance, and more of it the faster it is, so that it stands when a person who turns back comes up to it.
    It stands when the person does, and turns to see. A person who is out of sight is searched where it was last seen;
    after `patience` there the goal fails with `lost`. Other ends are `nobody`, and `blocked` if no way leads to a
    person who is seen.

    Example:
        follow_person: {type: person_follower, frame: laser_link, connect: {cmd_vel: cmd_vel/following}}
    """

    rate = 20.0
    steps_for_goals = True
    people = sdk.In(People, "people", may_be_silent=True)
    map = sdk.In(OccupancyGrid, "map", qos="latched", limits=BULK, is_open=True, may_be_silent=True)
    follow = sdk.ServesAction(
        FollowPerson,
        "follow_person",
        claims="base",
        outcomes={str(CompanionState.LOST): "failure", str(CompanionState.BLOCKED): "failure", NOBODY: "failure"},
        measures={"distance": LENGTH, "patience": TIME, "duration": TIME},
    )

    @classmethod
    def ports(cls, config: PersonFollowerConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with those of its laser, and where it and the robot are."""
        return super().ports(config) | {
            "scan": sdk.In(LaserScan, config.scan).named("scan"),
            "laser": sdk.Looks(source=config.frame, target=config.stands_in).named("laser"),
            "base": sdk.Looks(source="base_footprint", target=config.stands_in).named("base"),
        }

    @classmethod
    def capabilities(cls, config: PersonFollowerConfig) -> tuple[sdk.Capability, ...]:
        """Declare how fast it drives, and what it imports."""
        return (*super().capabilities(config), sdk.NeedsExtra(sdk.Setting("scipy"), sdk.Setting("navigation")))

    def configure(self) -> None:
        """Follow nobody yet."""
        self.grid: GridMap | None = None
        self.costs: LayeredCosts | None = None
        self.goal: ServedPerson | None = None
        self.companion: PersonCompanion | None = None
        self.scan = NewestMessage[LaserScan](self.config.frame)
        self.unusable = ""  # why the newest scan cannot be used
        self.began = self.seen = -math.inf  # [s]
        self.told: tuple[float, list[TrackedPerson]] = -math.inf, []
        self.walks = -math.inf  # when the person walked last, or was not near the place [s]

    def on_map(self, message: OccupancyGrid) -> None:
        """Take a map; what was seen before is forgotten."""
        if self.config.stands_in == (message.header.frame_id or MAP_FRAME):
            self.grid, self.costs = grid_of(message), None

    def on_people(self, message: People) -> None:
        """Note who is seen."""
        if message.header.frame_id in ("", self.config.stands_in):
            self.told = (
                self.now,
                [
                    TrackedPerson(
                        one.name, one.position.x, one.position.y, one.velocity.x, one.velocity.y, one.reliability
                    )
                    for one in message.people
                    if math.isfinite(one.position.x + one.position.y + one.velocity.x + one.velocity.y)
                ],
            )

    def on_scan(self, message: LaserScan) -> None:
        """Take a scan, now or as soon as it is known from where it was taken."""
        self.scan.put(message)
        self.take_scan()

    def take_scan(self) -> None:
        """Take the newest scan, unless that has been done or nobody is followed."""
        if self.costs is None or self.goal is None:
            return
        placed = self.scan.take(self.now, self.bound["laser"])
        self.unusable = self.scan.problem or self.unusable
        if placed is None:
            return
        message, (at,) = placed
        if self.costs.see(*level_rays(at, message), min(self.config.sees, message.range_max), self.now):
            self.seen = self.time_of(message.header.stamp)
            is_late = self.now - self.seen > self.config.silence
            self.unusable = f"its scans are {self.now - self.seen:.1f} s old" if is_late else ""
        else:
            self.unusable = "none of its numbers is a distance"

    def accept_follow(self, goal: FollowPerson.Goal) -> str:
        """Refuse what is no distance or time, and a place that is none."""
        numbers = goal.distance, goal.patience, goal.duration
        if not all(0.0 <= number < math.inf for number in numbers):
            return "its distance, patience or duration is not finite, or below 0"
        at = pose_in(goal.until.pose)
        is_place = goal.until.header.frame_id in ("", self.config.stands_in) and math.isfinite(at.x + at.y)
        return "" if is_place else f"its place is not given in '{self.config.stands_in}'"

    def step(self, dt: float) -> None:
        """Drive after the person."""
        goal = self.follow.current
        if goal is not self.goal:
            if goal is None:
                self.rest()
            self.goal, self.companion, self.costs = goal, None, None
            self.began = self.walks = self.now
            self.seen = -math.inf
        if goal is None:
            return
        if goal.cancel_requested:
            self.rest()
            goal.canceled()
            return
        if (pose := self.bound["base"].now(within=STALE)) is None:
            self.wait(goal, f"it is not known where the robot is in '{self.config.stands_in}'")
            return
        costs = self.around(pose)
        self.take_scan()
        if self.now - max(self.seen, self.began - self.config.silence / 2) > self.config.silence:
            laser = f"the laser on '{self.config.scan}'"
            self.wait(goal, f"{laser} is of no use: {self.unusable}" if self.unusable else f"{laser} is silent")
        elif self.seen > -math.inf:
            self.accompany(goal, pose, costs, dt)

    def around(self, pose: Pose2) -> LayeredCosts:
        """Return what is around the robot: that of the map, or of an area that moves with a robot that has none."""
        costs = self.costs
        if self.grid is None and costs is not None:
            middle = costs.grid.origin.compose(Pose2(BLANK / 2, BLANK / 2))
            costs = costs if pose.distance(middle) < BLANK / 4 else None
        if costs is None:
            side = round(BLANK / CELL)
            corner = Pose2(pose.x - BLANK / 2, pose.y - BLANK / 2)
            grid = self.grid or GridMap(np.zeros((side, side), np.int8), CELL, corner)
            outline = PolygonFootprint(self.config.corners) if self.config.corners else None
            settings = CostSettings(self.config.radius, self.config.inflation, outline=outline)
            settings = replace(settings, inflation=max(settings.inflation, settings.reach))
            costs = self.costs = LayeredCosts(grid, settings, [CostZone(*zone) for zone in self.config.zones])
            self.began = self.now if self.seen == -math.inf else self.began
        return costs

    def accompany(self, goal: ServedPerson, pose: Pose2, costs: LayeredCosts, dt: float) -> None:
        """Drive for one cycle, and end the goal if it is over."""
        request, config = goal.request, self.config
        time, people = self.told
        people = people if self.now - time <= RECENT else []
        patience = request.patience or config.patience
        if self.companion is None:
            target = whom_to_follow(pose, people)
            if target is None:
                self.rest()
                if self.now - self.began >= patience:
                    self.fail(goal, NOBODY, f"nobody was ahead for {patience:g} s")
                return
            driving = FollowerSettings(config.speed, config.turn_rate, config.acceleration)
            distance = request.distance or config.distance
            self.companion = PersonCompanion(driving, distance, patience, target, people)
            self.info(f"follows {target.name}")
        companion = self.companion
        self.drive(companion.update(self.now, dt, pose, people, costs))
        if companion.state is CompanionState.LOST:
            self.fail(goal, companion.state, f"{companion.target.name} was not seen again within {patience:g} s")
        elif companion.state is CompanionState.BLOCKED:
            self.fail(goal, companion.state, f"no way leads to {companion.target.name}")
        elif (request.duration and self.now - self.began >= request.duration) or self.is_there(request, companion):
            self.rest()
            goal.succeeded()
        else:
            away = companion.distance(pose)
            goal.feedback(FollowPerson.Feedback(str(companion.state), away, companion.target.name))

    def is_there(self, request: FollowPerson.Goal, companion: PersonCompanion) -> bool:
        """Return whether the person stands still near the place of a goal, and the robot beside it."""
        target, place = companion.target, pose_in(request.until.pose)
        is_near = math.hypot(target.x - place.x, target.y - place.y) <= AT_PLACE
        if not is_near or target.speed > STILL or companion.state is not CompanionState.STANDS:
            self.walks = self.now
        return bool(request.until.header.frame_id) and self.now - self.walks >= STANDS

    def wait(self, goal: ServedPerson, why: str) -> None:
        """Stand, but not for ever."""
        self.rest()
        if self.now - max(self.began, self.seen) >= self.config.silence + self.config.patience:
            self.fail(goal, "", why)

    def fail(self, goal: ServedPerson, outcome: str, why: str) -> None:
        """End a goal that has failed."""
        self.rest()
        goal.aborted(f"{outcome}: {why}" if outcome else why, FollowPerson.Result(outcome=outcome, message=why))

    def hold(self) -> None:
        """Command a halt: no step follows while robot time stands still."""
        if self.goal is not None:
            self.rest()

    def stop(self) -> None:
        """Command a halt."""
        self.rest()

    def rest(self) -> None:
        """Command a halt."""
        if self.companion is not None:
            self.companion.halt()
        self.drive(AT_REST)
