"""Follows trajectories of several joints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from rbxcompose.base.config import Angle, Config, JointName, Time
from rbxcompose.domains.servos import trajectory, trajectory_follower
from rbxcompose.domains.servos.controller import Controller, ControllerConfig, controller
from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.msgs.builtin_interfaces import Duration
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.fields import ArrayEntries
from rbxcompose.msgs.rbxcompose_msgs import MoveJoints
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.trajectory_msgs import JointTrajectory
from rbxcompose.sdk import BoundsGoals, Capability, In, MessageLimits, Port, ServesAction, Setting

Follow = FollowJointTrajectory
FOLLOW, MOVE, STREAM = "follow_joint_trajectory", "move", "joint_trajectory"  # its ports
NANOSECONDS = 1_000_000_000
TRAJECTORY = MessageLimits(size=2 * 1024 * 1024, entries=5_000)  # points


class TrajectoryToleranceConfig(Config):
    """How far joints may be from where they should be; those of a goal hold instead, if it has any."""

    path: Angle | None = Field(None, gt=0)
    """On the way; without it, that is not watched."""
    goal: Angle = Field(0.05, gt=0)
    """At the end."""
    goal_time: Time = Field(1.0, ge=0)
    """How long after the end of a trajectory its joints may take to arrive."""


class JointTrajectoryConfig(ControllerConfig):
    """Leads joints along trajectories."""

    type: Literal["joint_trajectory"] = "joint_trajectory"
    """How it leads its joints."""
    joints: list[JointName] = Field(min_length=1)
    """The joints that it leads."""
    interpolation: Literal["auto", "linear"] = "auto"
    """Between points without velocities: a smooth curve that ends at rest, or straight lines."""
    outside: Literal["refuse", "clamp"] = "refuse"
    """What to do with positions outside of the limits."""
    too_fast: Literal["refuse", "stretch"] = "refuse"
    """What to do with a trajectory that is too fast for a joint; `stretch` takes more time."""
    tolerance: TrajectoryToleranceConfig = TrajectoryToleranceConfig()
    """When a trajectory has failed."""

    @property
    def claimed(self) -> tuple[str, ...]:
        """Return the joints that it leads."""
        return tuple(self.joints)


@controller("joint_trajectory")
class JointTrajectoryController(Controller[JointTrajectoryConfig]):
    """Follows trajectories, by the action `NAME/follow_joint_trajectory` of ROS; `NAME/move` is the skill of missions.

    Trajectories on the topic `NAME/joint_trajectory` need no goal, as in ROS 2: each replaces what leads the joints,
    and its end is not reported. One without points brings them to rest.

    Trajectories are linear, cubic or quintic by what their points hold; one at 0 s is reached as fast as the limits
    allow, or on the way by joints that are within their tolerance of it. A new goal replaces the old one. However a
    trajectory ends, its joints come to rest within their limits.

    Example:
        head: {type: joint_trajectory, joints: [pan_joint, tilt_joint]}
    """

    @classmethod
    def ports(cls, name: str, config: JointTrajectoryConfig) -> dict[str, Port[Any]]:
        """Return both actions; `move` is a skill."""
        entries = ArrayEntries("joints", "positions", config.dimensions)
        return {
            FOLLOW: ServesAction(Follow, f"{name}/{FOLLOW}", claims=name, skill=None, limits=TRAJECTORY),
            MOVE: ServesAction(MoveJoints, f"{name}/{MOVE}", claims=name, skill=name, entries=entries),
            STREAM: In(JointTrajectory, f"{name}/{STREAM}", is_open=True, may_be_silent=True, limits=TRAJECTORY),
        }

    @classmethod
    def capabilities(cls, name: str, config: JointTrajectoryConfig) -> tuple[Capability, ...]:
        """Return that it refuses what its joints cannot reach, unless it goes to the nearest position."""
        led = Setting({joint: joint for joint in config.joints}, "joints")
        duration = Setting("duration") if config.too_fast == "refuse" else None
        return (BoundsGoals(MOVE, joints=led, duration=duration),) if config.outside == "refuse" else ()

    def prepare(self) -> None:
        """Set up the follower."""
        config, site = self.config, self.site
        policy = trajectory.TrajectoryPolicy(
            interpolation=config.interpolation,
            outside=config.outside,
            too_fast=config.too_fast,
            tolerance=trajectory.TrajectoryTolerance(config.tolerance.path, config.tolerance.goal),
            goal_time=config.tolerance.goal_time,
        )
        self.problem = ""
        self.follower = trajectory_follower.TrajectoryFollower(self._rules(), policy)
        follow = trajectory_follower.TrajectoryWay(site.action(FOLLOW), self._trajectory, result_of)
        self.goals = trajectory_follower.TrajectoryGoals(
            self.follower, {FOLLOW: follow, MOVE: trajectory_follower.move_way(site.action(MOVE))}
        )

    def _rules(self) -> dict[str, trajectory.JointRules]:
        """Return what joints may now: a servo may have been found to have less room than its joint was given."""
        return {name: joint.rules for name, joint in self.site.joints.items()}

    @property
    def leads(self) -> bool:
        """Return whether a trajectory runs."""
        return self.follower.is_following

    def accept(self, port: str, goal: Any) -> str:
        """Replace what leads the joints."""
        self.follower.joints = self._rules()
        self.goals.replace(port)
        return ""

    def cycle(self, now: float, dt: float) -> None:
        """Take over the newest goal, or its cancellation, and lead the joints."""
        joints = self.site.joints
        self.goals.take(now, lambda goal: self.follower.accept(goal, now, self._commanded()))
        for name, joint in joints.items():
            if self.follower.is_moving and joint.blocked:
                self._end(self.follower.lose(name, now, f"joint '{name}': {joint.blocked}"))
        step = self.follower.step(now, self._measured(), self._commanded())
        for name, sample in step.desired.items():
            joints[name].follow(sample)
        self._end(step.outcome)

    def halt(self, now: float, reason: str) -> None:
        """End the trajectory."""
        self._end(self.follower.abort(now, reason))

    def let_go(self, joint: str, now: float, reason: str) -> None:
        """End the trajectory; the joint is not led to rest."""
        self._end(self.follower.lose(joint, now, reason))

    def received(self, port: str, message: JointTrajectory) -> None:
        """Follow a trajectory that is no goal, or note what is wrong with it."""
        self.problem = ""
        if not message.points:
            self.halt(self.site.now, "a trajectory without points")
            return
        wanted = self._trajectory(Follow.Goal(trajectory=message))
        answer = self.follower.accept(wanted, self.site.now, self._commanded(), is_live=True)
        if isinstance(answer, trajectory.TrajectoryRefusal):
            self.problem = f"a trajectory was refused: {answer.message}"
        else:
            self.goals.replace(STREAM)

    @property
    def note(self) -> str:
        """Return at which speed goals are followed, and what was wrong with the last trajectory that was no goal."""
        share = self.follower.pace.share
        slow = [] if share == 1.0 else [f"at {share:.0%} of the speed" if share else "held: the speed is 0 %"]
        return "; ".join([*slow, *([self.problem] if self.problem else [])])

    def set_pace(self, share: float) -> str:
        """Follow goals at a share of their speed, from now on."""
        if problem := trajectory_follower.share_mistake(share):
            return problem
        self.follower.pace.share = share
        return ""

    def _trajectory(self, goal: Follow.Goal) -> trajectory.TrajectoryGoal:
        return trajectory_of(goal, self.site.now, self.site.stamp)

    def _measured(self) -> dict[str, JointSample]:
        return {name: joint.measured for name, joint in self.site.joints.items()}

    def _commanded(self) -> dict[str, JointSample]:
        return {name: joint.commanded for name, joint in self.site.joints.items()}

    def _end(self, outcome: trajectory_follower.TrajectoryOutcome | None) -> None:
        if outcome is not None:
            self.goals.end(outcome)


def result_of(code: trajectory.TrajectoryCode, message: str) -> Follow.Result:
    """Return how a trajectory ended as ROS writes it."""
    return Follow.Result(error_code=code, error_string=message)


def trajectory_of(goal: Follow.Goal, now: float, stamp: int) -> trajectory.TrajectoryGoal:
    """Return a goal as the follower takes it; its stamp [ns] is by the clock of headers, a zero one is now."""
    begin = to_nanoseconds(goal.trajectory.header.stamp)
    points = tuple(
        trajectory.TrajectoryPoint(
            seconds(point.time_from_start), tuple(point.positions), tuple(point.velocities), tuple(point.accelerations)
        )
        for point in goal.trajectory.points
    )
    paths = {one.name: one.position for one in goal.path_tolerance}
    ends = {one.name: (one.position, one.velocity) for one in goal.goal_tolerance}
    default = trajectory.TrajectoryTolerance()
    tolerances = {
        name: trajectory.TrajectoryTolerance(
            allowed(paths.get(name, 0.0), default.path),
            allowed(ends.get(name, (0.0, 0.0))[0], default.goal),
            allowed(ends.get(name, (0.0, 0.0))[1], default.velocity),
        )
        for name in {*paths, *ends}
    }
    return trajectory.TrajectoryGoal(
        tuple(goal.trajectory.joint_names),
        points,
        now + (begin - stamp) / NANOSECONDS if begin else 0.0,
        tolerances,
        seconds(goal.goal_time_tolerance) or None,
    )


def allowed(written: float, default: float | None) -> float | None:
    """Return a tolerance as ROS writes it: 0 is the default, a negative one is no limit."""
    return default if written == 0.0 else None if written < 0.0 else written


def seconds(duration: Duration) -> float:
    """Return a duration in seconds."""
    return duration.sec + duration.nanosec / NANOSECONDS
