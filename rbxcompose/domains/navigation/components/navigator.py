"""Driving to poses of a map, around what is in the way."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from random import Random
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import AT_REST, Pose2
from rbxcompose.base.printable import plain
from rbxcompose.base.units import ANGLE, LENGTH, MOST
from rbxcompose.domains.bases.driving import BaseDriver
from rbxcompose.domains.navigation.costs import (
    DEAREST,
    INSCRIBED,
    LETHAL,
    NO_INFORMATION,
    CostSettings,
    CostZone,
    LayeredCosts,
)
from rbxcompose.domains.navigation.follower import FollowerSettings, FollowState, PathFollower
from rbxcompose.domains.navigation.localiser import STALE
from rbxcompose.domains.navigation.manoeuvres import BackUpManoeuvre, Manoeuvre, ManoeuvreState, SpinManoeuvre
from rbxcompose.domains.navigation.planner import NoPathError, PlannedPath, plan
from rbxcompose.domains.navigation.reports import zone_markers
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.shapes import PolygonFootprint
from rbxcompose.domains.worlds.world import MAP_FRAME, grid_message, grid_of
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.nav2_msgs import BackUp as Nav2BackUp
from rbxcompose.msgs.nav2_msgs import NavigateThroughPoses, NavigateToPose, Spin
from rbxcompose.msgs.nav_msgs import OccupancyGrid, Path
from rbxcompose.msgs.poses import message_of, pose_in
from rbxcompose.msgs.rbxcompose_msgs import BackUp, RunMission
from rbxcompose.msgs.sensor_arrays import level_rays
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import LONGEST, to_duration, to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.msgs.visualization_msgs import MarkerArray
from rbxcompose.sdk.bound import NewestMessage
from rbxcompose.sdk.ports import BULK

AGAIN = 1.0  # [s] between two looks whether the way is free, and between two plans
YIELD = 4.0  # [s] for which it stands after a recovery, at most; by chance, so that of two that meet one goes first
BACK_UP_SPEED = 0.1  # [m/s]
BASE, RUN = "base", "run_mission"
TURN_ACCELERATION = 1.5  # [rad/s^2]
NEAR_CORNERS = 0.1  # [m]
PROGRESS = 0.3  # moving this far counts as progress, towards the goal once something has been tried [m]
SHOWN = 1.0  # [s] between two costmaps
SPUN = math.radians(3600)  # the largest turn [rad]
BACKED = 2.0  # the farthest that it backs up [m]
ServedPose = sdk.ServedGoal[NavigateToPose.Goal, NavigateToPose.Result, NavigateToPose.Feedback]
ServedPoses = sdk.ServedGoal[NavigateThroughPoses.Goal, NavigateThroughPoses.Result, NavigateThroughPoses.Feedback]


class ShownGoal:
    """A goal that came as a message: nobody waits for its end."""

    cancel_requested = False

    def __init__(self, pose: geometry.PoseStamped, warn: Callable[[str], None]) -> None:
        self.request = NavigateToPose.Goal(pose=pose)
        self.is_over = False
        self._warn = warn

    def feedback(self, message: NavigateToPose.Feedback, /) -> None:
        """Report to nobody."""

    def succeeded(self, result: NavigateToPose.Result | None = None, /) -> None:
        """End."""
        self.is_over = True

    def aborted(self, reason: str = "", result: NavigateToPose.Result | None = None, /) -> None:
        """End, and log the reason."""
        self.is_over = True
        self._warn(f"the goal on 'goal_pose' ends: {reason}")

    def canceled(self, result: NavigateToPose.Result | None = None, /) -> None:
        """End."""
        self.is_over = True


NavigatorGoal = ServedPose | ServedPoses | ShownGoal
ManoeuvreGoal = sdk.ServedGoal[Any, Any, Any]


class NavigatorConfig(sdk.Config):
    """How the robot drives, and how much room it needs."""

    radius: Annotated[sdk.Length, sdk.Live()] = Field(0.2, gt=0)
    """Radius of the robot seen from above [m]; of one that is no circle, of the circle which it covers."""
    corners: tuple[tuple[float, float], ...] = ()
    """Corners of a robot that is no circle, in its frame [m]."""
    inflation: Annotated[sdk.Length, sdk.Live()] = Field(0.45, gt=0)
    """Up to this distance from obstacles, ways are dearer."""
    unknown_is_free: Annotated[bool, sdk.Live()] = True
    """Whether ways may lead through what the map does not know."""
    zones: tuple[tuple[str, tuple[tuple[float, float], ...], float], ...] = ()
    """Name, corners [m] and share of the speed of each zone; a share of 0 keeps out."""
    scan: str = ""
    """Topic of the laser that sees obstacles; empty if there is none."""
    scan_frame: str = "laser_link"
    """The frame of the laser."""
    sees: Annotated[sdk.Length, sdk.Live()] = Field(3.0, gt=0)
    """Up to here, obstacles count."""
    silence: Annotated[sdk.Time, sdk.Live()] = Field(1.0, gt=0)
    """Without a scan for so long, the robot stops."""
    patience: Annotated[sdk.Time, sdk.Live()] = Field(15.0, gt=0)
    """If it gets no further for so long, it tries a recovery; the goal fails if there is none, or it cannot drive."""
    recovery: Annotated[str, sdk.Live()] = ""
    """The mission that runs when it gets no further; empty if it only waits."""
    trees: tuple[str, ...] = ()
    """Missions that a goal may name as its `behavior_tree`, to run instead."""
    speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.4, gt=0)
    """Largest speed."""
    turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(math.radians(75), gt=0)
    """Largest turn rate."""
    acceleration: Annotated[sdk.Acceleration, sdk.Live()] = Field(0.5, gt=0)
    """Acceleration, also for braking."""
    look_ahead: Annotated[sdk.Length, sdk.Live()] = Field(0.5, gt=0)
    """How far ahead on its way the robot aims."""
    tolerance: Annotated[sdk.Length, sdk.Live()] = Field(0.1, gt=0)
    """How far from the goal it may end."""
    heading_tolerance: Annotated[sdk.Angle, sdk.Live()] = Field(math.radians(5), gt=0)
    """How far from the goal's heading it may end."""


@sdk.component("navigator")
class Navigator(BaseDriver[NavigatorConfig]):
    """Drives to poses of the map on the cheapest way that keeps off walls, and off what its laser sees.

    Example:
        go_to: {type: navigator, speed: 0.4 m/s}
    """

    made_by = "The section `navigation` runs it."
    rate = 20.0
    plan = sdk.Out(Path, "plan")
    costmap = sdk.Out(OccupancyGrid, "global_costmap/costmap", qos="latched")
    map = sdk.In(OccupancyGrid, "map", qos="latched", limits=BULK)
    pose = sdk.Looks(source="base_footprint", target=MAP_FRAME)
    go_to = sdk.ServesAction(NavigateToPose, "go_to", claims=BASE)
    navigate = sdk.ServesAction(NavigateToPose, "navigate_to_pose", claims=BASE, skill=None)
    through = sdk.ServesAction(NavigateThroughPoses, "navigate_through_poses", claims=BASE, skill=None)
    spin = sdk.ServesAction(Spin, "spin", claims=BASE, measures={"target_yaw": ANGLE})
    back_up = sdk.ServesAction(BackUp, "back_up", claims=BASE, measures={"distance": LENGTH})
    backup = sdk.ServesAction(Nav2BackUp, "backup", claims=BASE, skill=None)
    clear_costs = sdk.Serves(Trigger, "clear_costs")
    goal_pose = sdk.In(geometry.PoseStamped, "goal_pose", qos="event", is_open=True, may_be_silent=True)

    @classmethod
    def ports(cls, config: NavigatorConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with those of its laser, and what shows its zones."""
        laser: dict[str, sdk.Port[Any]] = {
            "scan": sdk.In(LaserScan, config.scan or "scan").named("scan"),
            "laser": sdk.Looks(source=config.scan_frame, target=MAP_FRAME).named("laser"),
        }
        recovery: dict[str, sdk.Port[Any]] = {RUN: sdk.CallsAction(RunMission, RUN).named(RUN)}
        zones: dict[str, sdk.Port[Any]] = {"zones": sdk.Out(MarkerArray, "zone_markers", qos="latched").named("zones")}
        found = super().ports(config) | (laser if config.scan else {})
        return found | (recovery if config.recovery else {}) | (zones if config.zones else {})

    @classmethod
    def capabilities(cls, config: NavigatorConfig) -> tuple[sdk.Capability, ...]:
        """Declare how fast it drives, how near it comes, and how much room it keeps."""
        names = "inflation", *(() if config.corners else ("radius",)), *(("sees", "silence") if config.scan else ())
        room: dict[str, Any] = {name: sdk.Setting(getattr(config, name), name) for name in names}
        return (
            *super().capabilities(config),
            sdk.Navigates("go_to", sdk.Setting(config.tolerance, "tolerance"), **room),
            sdk.NeedsExtra(sdk.Setting("scipy"), sdk.Setting("navigation")),
        )

    def configure(self) -> None:
        """Know no map yet."""
        self.costs: LayeredCosts | None = None
        self.follower = PathFollower(follower_settings(self.config))
        self.goal: NavigatorGoal | None = None
        self.poses: list[Pose2] = []  # to drive to, one after the other
        self.shown_goal: ShownGoal | None = None
        self.path: PlannedPath | None = None
        self.reason = ""  # why there is no way now
        self.approaches = False  # whether the way ends near a goal where something is
        self.yields = -math.inf  # until when it stands after a recovery [s]
        self.came = math.inf  # how near to it such ways have led [m]
        self.least = math.inf  # how far it was to the last pose when it got on last [m]
        wrong = "it is in '{}', not in '{}': set 'frame' of 'obstacles'"
        self.scan = NewestMessage[LaserScan](self.config.scan_frame, wrong)
        self.unusable = ""  # why the newest scan cannot be used
        self.began = self.seen = self.looked = self.waits = self.shown = self.turned = -math.inf  # [s]
        self.started = -math.inf  # when the whole robot was active [s]
        self.recoveries = self.attempts = 0  # for this goal, and since it got on last
        self.recovery: sdk.SentGoal | None = None  # that runs
        self.manoeuvre: Manoeuvre | None = None
        self.manoeuvred: ManoeuvreGoal | None = None  # its goal
        self.mark = Pose2()  # where it was when it moved last, at the time `waits`

    def activate(self) -> None:
        """Show the zones."""
        if self.config.zones:
            zones = [CostZone(*zone) for zone in self.config.zones]
            self.bound["zones"](zone_markers(zones, Header(stamp=to_time(self.stamp), frame_id=MAP_FRAME)))

    def start(self) -> None:
        """Let the first scan take a moment."""
        self.started = self.now

    def reconfigure(self, old: NavigatorConfig) -> None:
        """Drive on with the new settings; another radius does not fit to corners, and recoveries are missions."""
        config = self.config
        if config.corners and config.radius != old.radius:
            raise sdk.Refused("the robot is no circle: its 'footprint' has corners")
        if config.recovery not in (old.recovery, "", *config.trees):
            raise sdk.Refused(f"'{plain(config.recovery, 80)}' is no mission of the robot")
        self.follower.settings = follower_settings(config)
        if self.costs is not None and cost_settings(old) != cost_settings(config):
            self.costs.set(cost_settings(config))
            self.looked = -math.inf

    def on_map(self, message: OccupancyGrid) -> None:
        """Take a map; what was seen before is forgotten."""
        zones = [CostZone(*zone) for zone in self.config.zones]
        self.costs = LayeredCosts(grid_of(message), cost_settings(self.config), zones)
        self.path = None
        self.show()

    def on_scan(self, message: LaserScan) -> None:
        """Take a scan, now or as soon as it is known from where it was taken."""
        self.scan.put(message)
        self.take_scan()

    def take_scan(self) -> None:
        """Take the newest scan, unless that has been done; one that cannot be used is as good as none."""
        if self.costs is None or "laser" not in self.bound:
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
            self.show()
        else:
            self.unusable = "none of its numbers is a distance"

    def accept_navigate(self, goal: NavigateToPose.Goal) -> str:
        """Refuse what `go_to` refuses."""
        return self.accept_go_to(goal)

    def accept_through(self, goal: NavigateThroughPoses.Goal) -> str:
        """Refuse a goal without poses, or one with a pose that `go_to` refuses."""
        if not goal.poses:
            return "there are no poses"
        each = (NavigateToPose.Goal(pose=pose, behavior_tree=goal.behavior_tree) for pose in goal.poses)
        return next(filter(None, map(self.accept_go_to, each)), "")

    def on_goal_pose(self, message: geometry.PoseStamped) -> None:
        """Drive to a pose that somebody pointed at in a viewer."""
        if why := self.accept_go_to(NavigateToPose.Goal(pose=message)):
            self.warn(f"a goal on 'goal_pose' was refused: {why}")
        else:
            self.shown_goal = ShownGoal(message, self.warn)

    def accept_go_to(self, goal: NavigateToPose.Goal) -> str:
        """Refuse a goal in another frame, one that is no pose, and trees of Nav2, for which recoveries stand."""
        if (tree := goal.behavior_tree) and tree not in self.config.trees:
            return f"'behavior_tree' is the name of a mission that recovers, and '{plain(tree, 80)}' is none"
        frame, pose = goal.pose.header.frame_id, pose_in(goal.pose.pose)
        if frame not in ("", MAP_FRAME):
            return f"a goal must be given in '{MAP_FRAME}', not in '{frame}'"
        is_near = all(abs(number) < MOST for number in (pose.x, pose.y, pose.heading))
        return "" if is_near else "the numbers of a pose must be finite, and below 1e15"

    def accept_spin(self, goal: Spin.Goal) -> str:
        """Refuse a turn during a drive, and one that is none."""
        is_turn = math.isfinite(goal.target_yaw) and abs(goal.target_yaw) <= SPUN
        return self.accept_manoeuvre() if is_turn else "the turn is too large"

    def accept_back_up(self, goal: BackUp.Goal) -> str:
        """Refuse to back up during a drive, or for no distance."""
        return self.accept_manoeuvre() if 0 < goal.distance <= BACKED else f"it backs up by at most {BACKED:g} m"

    def accept_backup(self, goal: Nav2BackUp.Goal) -> str:
        """Refuse what `back_up` refuses, and a speed that is none."""
        if not 0 < goal.speed <= self.config.speed:
            return f"the speed must be above 0 and at most {self.config.speed:g} m/s"
        return self.accept_back_up(BackUp.Goal(distance=abs(goal.target.x)))

    def accept_manoeuvre(self) -> str:
        """Refuse a manoeuvre during a drive, unless that has come to a stand."""
        return "" if self.goal is None or self.recovery is not None else "the robot drives to a goal"

    def on_clear_costs(self, request: Trigger.Request) -> Trigger.Response:
        """Forget what sensors have seen."""
        if self.costs is None:
            return Trigger.Response(success=False, message="there is no map")
        self.costs.clear()
        return Trigger.Response(success=True)

    def stop(self) -> None:
        """Forget a goal that nobody waits for: motion must not begin by itself when the stop is released."""
        if self.shown_goal is not None:
            self.shown_goal.canceled()
        self.leave_recovery()
        self.rest()

    def step(self, dt: float) -> None:
        """Drive on to the goal."""
        self.take_scan()
        goal = self.wanted()
        if goal is not self.goal:
            self.leave_recovery()
            if goal is None:
                self.rest()
        if self.manoeuvres(goal, dt) or goal is None:
            self.goal = goal
            return
        if goal is not self.goal:
            self.goal, self.path, self.recoveries, self.attempts = goal, None, 0, 0
            self.approaches, self.came, self.least, self.yields = False, math.inf, math.inf, -math.inf
            self.poses = poses_of(goal.request)
            self.mark = Pose2(math.inf, math.inf)
            self.began = self.waits = self.now
            self.looked = -math.inf
        if goal.cancel_requested:
            self.leave_recovery()
            self.rest()
            goal.canceled()
        elif self.recovery is not None or self.now < self.yields:
            self.waits = self.now
            self.wait(goal, self.reason)
        elif (trouble := self.trouble()) or (pose := self.pose.now(within=STALE)) is None or self.costs is None:
            self.wait(goal, trouble or f"it is not known where the robot is in '{MAP_FRAME}'")
        else:
            self.drive_on(goal, pose, self.costs, dt)

    def wanted(self) -> NavigatorGoal | None:
        """Return the goal to drive to: the newest one; older ones end."""
        sources = (self.go_to.current, self.navigate.current, self.through.current, self.shown_goal)
        goals = [goal for goal in sources if goal is not None and not getattr(goal, "is_over", False)]
        newest = next((goal for goal in goals if goal is not self.goal), None) or (goals[0] if goals else None)
        for goal in goals:
            if goal is not newest:
                abort(goal, "replaced by a newer goal")
        return newest

    def trouble(self) -> str:
        """Return what keeps the robot from driving; nothing if all is well."""
        return "there is no map" if self.costs is None else self.silence()

    def silence(self) -> str:
        """Return which laser is silent or of no use, also if it has never told anything; nothing if none is."""
        if not self.config.scan or self.now - self.seen <= self.config.silence:
            return ""
        laser = f"the laser on '{self.config.scan}'"
        return f"{laser} is of no use: {self.unusable}" if self.unusable else f"{laser} is silent"

    def drive_on(self, goal: NavigatorGoal, pose: Pose2, costs: LayeredCosts, dt: float) -> None:
        """Plan if that is necessary, and follow the way."""
        if self.mark.distance(pose) > PROGRESS:
            self.mark, self.waits = pose, self.now
        if len(self.poses) > 1 and pose.distance(self.poses[0]) <= self.config.look_ahead:
            self.aim_at_next()
        if self.now - self.looked >= AGAIN:
            self.looked = self.now
            if self.path is None or self.approaches or self.path.is_blocked(pose, costs):
                self.find_way(goal, pose, costs)
        if self.path is None:
            if goal is self.goal:
                self.recover(goal)
            return
        velocity, state = self.follower.update(pose, costs, dt)
        self.track_progress(self.path)
        if state in (FollowState.BLOCKED, FollowState.STUCK):
            self.path, self.reason = None, "something is in the way" if state is FollowState.BLOCKED else "it is stuck"
            self.recover(goal)
            return
        self.drive(velocity)
        if state is FollowState.REACHED:
            if self.approaches:
                self.path = None
            elif len(self.poses) > 1:  # within the tolerance, though that is wider than the look-ahead
                self.aim_at_next()
            else:
                goal.succeeded()
        elif self.now - self.waits >= self.config.patience:
            self.path, self.reason = None, "it gets no further"
            self.recover(goal)
        else:
            self.report(goal, pose)

    def track_progress(self, path: PlannedPath) -> None:
        """Note how far it is to the goal; what is driven to and fro, after a recovery, is no progress."""
        stops = path.poses[-1], *self.poses
        left = self.follower.left + sum(before.distance(after) for before, after in pairwise(stops))
        if self.attempts and left < self.least - PROGRESS:
            self.attempts = 0
        if not self.attempts or math.isinf(self.least):
            self.least = left

    def aim_at_next(self) -> None:
        """Drive on to the next pose, without a stop."""
        del self.poses[0]
        self.path, self.looked = None, -math.inf
        self.approaches, self.came = False, math.inf

    def recover(self, goal: NavigatorGoal) -> None:
        """Run the mission that may help; without one, wait."""
        self.approaches = False
        if not self.config.recovery or not self.bound[RUN].is_available:
            self.wait(goal, self.reason)
            return
        self.rest()
        self.recoveries, self.attempts = self.recoveries + 1, self.attempts + 1
        mission = goal.request.behavior_tree or self.config.recovery
        self.info(f"runs mission {mission}, attempt {self.attempts}: {self.reason}")

        number = self.recoveries

        def ended(end: sdk.Ended[RunMission.Result]) -> None:
            if self.recovery is None or number != self.recoveries:
                return
            self.recovery, self.looked = None, -math.inf
            if (pose := self.pose.now()) is not None:
                self.mark = pose  # what a recovery drives is no progress
                self.yields = self.now + YIELD * Random(f"{pose} {self.recoveries}").random()  # noqa: S311 - no secret
            if end.outcome is not sdk.Outcome.SUCCEEDED and self.goal is goal:
                self.fail(goal, f"{self.reason}, and nothing that was tried has helped")

        request = RunMission.Goal(mission=mission, inputs=("attempt",), values=(str(self.attempts),), lends=(BASE,))
        self.recovery = self.bound[RUN](request, ended)

    def leave_recovery(self) -> None:
        """End the mission that was to help, if it runs."""
        if self.recovery is not None:
            self.recovery.cancel()
            self.recovery = None

    def manoeuvres(self, goal: NavigatorGoal | None, dt: float) -> bool:
        """Carry out a manoeuvre, if one is wanted: by itself, or while a goal waits for a recovery."""
        wanted = self.back_up.current or self.backup.current or self.spin.current
        if wanted is not None and goal is not None and self.recovery is None:
            wanted.aborted("replaced by a newer goal")
            wanted = None
        if wanted is not self.manoeuvred:
            self.manoeuvred, self.turned = wanted, self.now
            if wanted is None:
                self.rest()
            else:
                self.manoeuvre = manoeuvre_of(wanted.request, self.config.turn_rate)
        if wanted is None or self.manoeuvre is None:
            return False
        if goal is not None and goal.cancel_requested:
            return False
        if wanted.cancel_requested:
            self.rest()
            wanted.canceled()
        elif (why := self.silence()) and self.now - self.started <= self.config.silence:
            self.rest()  # the first scan may be on its way
        elif (pose := self.pose.now(within=STALE)) is None or why:
            why = why or f"it is not known where the robot is in '{MAP_FRAME}'"
            self.end_manoeuvre(wanted, why, Spin.Result.TF_ERROR)
        elif 0 < (allowed := seconds_of(wanted.request)) < self.now - self.turned:
            self.end_manoeuvre(wanted, f"it took longer than the allowed {allowed:g} s", Spin.Result.TIMEOUT)
        else:
            velocity, state = self.manoeuvre.update(pose, self.costs, dt)
            self.drive(velocity)
            wanted.feedback(told_of(wanted.request, self.manoeuvre))
            if state is ManoeuvreState.DONE:
                wanted.succeeded(result_of(wanted.request, self.now - self.turned))
            elif state is ManoeuvreState.STUCK:
                self.end_manoeuvre(wanted, "the robot hardly moves: something may hold it", Spin.Result.TIMEOUT)
            elif state is ManoeuvreState.BLOCKED:
                is_turn = isinstance(self.manoeuvre, SpinManoeuvre)
                why = "there is no room to turn" if is_turn else "something is behind the robot"
                self.end_manoeuvre(wanted, why, Spin.Result.COLLISION_AHEAD)
            if goal is not None:
                self.report(goal, pose)
        return True

    def end_manoeuvre(self, wanted: ManoeuvreGoal, why: str, code: int) -> None:
        """End a manoeuvre that failed, with an error code of `spin`."""
        self.rest()
        wanted.aborted(why, result_of(wanted.request, self.now - self.turned, why, code))

    def find_way(self, goal: NavigatorGoal, pose: Pose2, costs: LayeredCosts) -> None:
        """Plan."""
        try:
            self.path = plan(costs, pose, self.poses[0], self.config.tolerance)
        except NoPathError as error:
            near = "" if math.isinf(error.nearest) else f"; it could get within {error.nearest:.1f} m"
            self.path, self.reason = None, f"{error}{near}"
            gain = min(self.poses[0].distance(pose), math.inf if self.approaches else self.came) - error.nearest
            self.approaches = error.is_occupied and gain > PROGRESS
            if error.is_final:
                self.fail(goal, self.reason)
            elif self.approaches:  # what is at the goal may be gone by then, such as another robot
                self.came = min(self.came, error.nearest)
                self.path = plan(costs, pose, self.poses[0], error.nearest + costs.grid.resolution)
            if self.path is None:
                return
        else:
            self.approaches = False
        self.follower.start(self.path)
        self.plan(path_message(self.path, Header(stamp=to_time(self.stamp), frame_id=MAP_FRAME)))

    def wait(self, goal: NavigatorGoal, why: str) -> None:
        """Stand until there is a way, but not for ever."""
        self.rest()
        if self.now - self.waits >= self.config.patience:
            self.fail(goal, why)
        elif (pose := self.pose.now()) is not None:
            self.report(goal, pose)

    def fail(self, goal: NavigatorGoal, why: str) -> None:
        """End a goal that cannot be reached."""
        self.leave_recovery()
        self.rest()
        self.goal = None
        abort(goal, why)

    def report(self, goal: NavigatorGoal, pose: Pose2) -> None:
        """Report how far it is."""
        at = geometry.PoseStamped(header=Header(stamp=to_time(self.stamp), frame_id=MAP_FRAME), pose=message_of(pose))
        away = self.follower.left + sum(before.distance(after) for before, after in pairwise(self.poses))
        spent, left = to_duration(self.now - self.began), to_duration(min(LONGEST, away / self.config.speed))
        told = at, spent, left, self.recoveries, away
        if isinstance(goal.request, NavigateThroughPoses.Goal):
            goal.feedback(NavigateThroughPoses.Feedback(*told, len(self.poses)))
        else:
            goal.feedback(NavigateToPose.Feedback(*told))

    def hold(self) -> None:
        """Command a halt: no step follows while robot time stands still."""
        if self.goal is not None or self.manoeuvred is not None:
            self.rest()

    def rest(self) -> None:
        """Command a halt."""
        self.follower.halt()
        self.drive(AT_REST)

    def show(self) -> None:
        """Publish the costs, if anybody looks, at most once a second."""
        if self.costs is None or self.now - self.shown < SHOWN or not self.costmap.is_wanted:
            return
        self.shown = self.now
        table = np.arange(256) * 98 // DEAREST
        table[[INSCRIBED, LETHAL, NO_INFORMATION]] = 99, 100, -1
        shown = GridMap(table.astype(np.int8)[self.costs.values], self.costs.grid.resolution, self.costs.grid.origin)
        self.costmap(grid_message(shown, Header(stamp=to_time(self.stamp), frame_id=MAP_FRAME)))


def abort(goal: NavigatorGoal, why: str) -> None:
    """End a goal with the reason in its result."""
    action: Any = NavigateThroughPoses if isinstance(goal.request, NavigateThroughPoses.Goal) else NavigateToPose
    goal.aborted(why, action.Result(error_code=1, error_msg=why))


def follower_settings(config: NavigatorConfig) -> FollowerSettings:
    """Return the settings of the follower."""
    return FollowerSettings(
        speed=config.speed,
        turn_rate=config.turn_rate,
        acceleration=config.acceleration,
        look_ahead=config.look_ahead,
        tolerance=config.tolerance,
        heading_tolerance=config.heading_tolerance,
    )


def cost_settings(config: NavigatorConfig) -> CostSettings:
    """Return the settings of the costs."""
    outline = PolygonFootprint(config.corners) if config.corners else None
    found = CostSettings(config.radius, unknown_is_free=config.unknown_is_free, outline=outline)
    # Of a robot with corners, distances count a little further than it reaches.
    return replace(found, inflation=max(config.inflation, found.reach + (NEAR_CORNERS if outline else 0.0)))


def manoeuvre_of(request: BackUp.Goal | Nav2BackUp.Goal | Spin.Goal, turn_rate: float) -> Manoeuvre:
    """Return what a goal wants, with the turn rate of turns [rad/s]."""
    if isinstance(request, Spin.Goal):
        return SpinManoeuvre(request.target_yaw, turn_rate, TURN_ACCELERATION)
    if isinstance(request, BackUp.Goal):
        return BackUpManoeuvre(request.distance, BACK_UP_SPEED)
    return BackUpManoeuvre(abs(request.target.x), request.speed)


def seconds_of(request: BackUp.Goal | Nav2BackUp.Goal | Spin.Goal) -> float:
    """Return how long a manoeuvre may take [s]; 0 if that is not limited."""
    if isinstance(request, BackUp.Goal):
        return 0.0
    return request.time_allowance.sec + request.time_allowance.nanosec * 1e-9


def told_of(request: BackUp.Goal | Nav2BackUp.Goal | Spin.Goal, manoeuvre: Manoeuvre) -> Any:
    """Return the feedback of a manoeuvre."""
    done = abs(manoeuvre.whole - manoeuvre.left)
    if isinstance(request, Spin.Goal):
        return Spin.Feedback(angular_distance_traveled=done)
    if isinstance(request, BackUp.Goal):
        return BackUp.Feedback(distance_left=manoeuvre.left)
    return Nav2BackUp.Feedback(distance_traveled=done)


def result_of(request: BackUp.Goal | Nav2BackUp.Goal | Spin.Goal, time: float, why: str = "", code: int = 0) -> Any:
    """Return the result of a manoeuvre that took a time [s]; error codes of `backup` are those of `spin` plus 10."""
    if isinstance(request, BackUp.Goal):
        return BackUp.Result(message=why)
    if isinstance(request, Spin.Goal):
        return Spin.Result(to_duration(time), code, why)
    return Nav2BackUp.Result(to_duration(time), code + 10 if code else 0, why)


def poses_of(request: NavigateToPose.Goal | NavigateThroughPoses.Goal) -> list[Pose2]:
    """Return where a goal leads, one after the other."""
    poses = request.poses if isinstance(request, NavigateThroughPoses.Goal) else (request.pose,)
    return [pose_in(pose.pose) for pose in poses]


def path_message(path: PlannedPath, header: Header) -> Path:
    """Return a way as a message."""
    stamped = partial(geometry.PoseStamped, header)
    return Path(header, tuple(stamped(message_of(pose)) for pose in path.poses))
