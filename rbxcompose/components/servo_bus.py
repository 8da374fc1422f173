"""Drives the joints that the servos of a bus turn."""

from __future__ import annotations

import math
from contextlib import ExitStack
from functools import partial
from typing import Any, Literal

import numpy as np

from rbxcompose.actuation.bus import ServoBus as Bus
from rbxcompose.actuation.joint_drive import JointDrive, ServoJoint
from rbxcompose.actuation.port_errors import PortError
from rbxcompose.actuation.servo_cycle import ServoCycle
from rbxcompose.actuation.servo_models import model_named
from rbxcompose.control.joint_states import Enable, Hold, JointMode, JointPolicy, MoveTo, Relax
from rbxcompose.control.limits import MotionLimits
from rbxcompose.control.trajectory import (
    TrajectoryGoal,
    TrajectoryPoint,
    TrajectoryPolicy,
    TrajectoryRefusal,
    TrajectoryTolerance,
)
from rbxcompose.control.trajectory_follower import TrajectoryFollower, TrajectoryOutcome
from rbxcompose.control.trajectory_plan import JointRules
from rbxcompose.levels import Level
from rbxcompose.msgs.builtin_interfaces import Duration
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_nanoseconds, to_time
from rbxcompose.msgs.std_msgs import Float64, Header
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.requests import Refused, answers
from rbxcompose.sdk import Component, Config, In, Out, Port, ServedGoal, Serves, ServesAction, component
from rbxcompose.sdk.component import Context
from rbxcompose.twins.fault_script import FaultScript, InjectFault, TwinFault
from rbxcompose.twins.servo_stage import twin_of, twin_servos
from rbxcompose.twins.servo_twin import TwinBus

Follow = FollowJointTrajectory
NANOSECONDS = 1_000_000_000
GONE = "the bus of servos has gone"
REOPEN = 0.5  # [s] between attempts to find a port that has gone
REPORT = 1.0  # [s] between reports to diagnostics
PUBLISHED = 50.0  # [Hz] of joint states, at most


class DrivenJointConfig(Config):
    """A joint and its servo, in radians."""

    id: int
    """Id of the servo."""
    model: str
    """Model of the servo."""
    neutral: int | None = None
    """The tick at position 0; without it the middle of the range."""
    invert: bool = False
    """Whether it turns the other way round."""
    lower: float | None = None
    """Least position [rad]."""
    upper: float | None = None
    """Greatest position [rad]."""
    velocity: float | None = None
    """Largest speed [rad/s]."""
    acceleration: float | None = None
    """Largest acceleration [rad/s^2]."""


class ControllerConfig(Config):
    """A group of joints that follows trajectories."""

    joints: list[str]
    """Names of its joints."""


class ServoBusConfig(Config):
    """A bus of servos, its joints and its controllers."""

    port: str = ""
    """The serial port."""
    baud: int = 1_000_000
    """Bits per second."""
    rate: float = 100.0
    """Cycles per second."""
    twin: Literal["", "ideal", "servo", "pty"] = ""
    """How its servos are simulated, if they are."""
    noise: float = 0.0
    """Standard deviation of the positions that simulated servos measure [rad]."""
    seed: int = 0
    """Repeats the noise."""
    faults: dict[str, TwinFault] = {}
    """What goes wrong with simulated servos, by names."""
    on_shutdown: Literal["relax", "hold"] = "relax"
    """What happens to torque at the end."""
    joints: dict[str, DrivenJointConfig] = {}
    """Joints by name."""
    controllers: dict[str, ControllerConfig] = {}
    """Controllers by name."""


@component("servo_bus")
class ServoBusDriver(Component[ServoBusConfig]):
    """Reads and writes the servos of a bus, keeps their joints within limits, and follows trajectories.

    Each joint has a topic `JOINT/command` [rad], and the services `JOINT/relax` and `JOINT/enable`. A joint starts
    relaxed; the first command switches its torque on, where it is. A controller serves the action
    `NAME/follow_joint_trajectory`.

    Example:
        servos: {type: servo_bus, twin: servo, joints: {pan: {id: 1, model: AX-12}}}
    """

    made_by = "Each entry of `buses` runs one."
    process = "servos"
    joint_states = Out(JointState, "joint_states")

    @classmethod
    def ports(cls, config: ServoBusConfig) -> dict[str, Port[Any]]:
        """Return the ports: for each joint, and for each controller."""
        found = super().ports(config)
        for name in config.joints:
            found[f"{name}_command"] = In(Float64, f"{name}/command", qos="command", is_open=True).named(
                f"{name}_command"
            )
            found[f"{name}_relax"] = Serves(Trigger, f"{name}/relax").named(f"{name}_relax")
            found[f"{name}_enable"] = Serves(SetBool, f"{name}/enable").named(f"{name}_enable")
        for name in config.controllers:
            action = ServesAction(Follow, f"{name}/follow_joint_trajectory", claims=name, skill=name)
            found[name] = action.named(name)
        return found

    def __init__(self, name: str, config: ServoBusConfig, context: Context) -> None:
        """Give the ports of joints and controllers their methods."""
        super().__init__(name, config, context)
        for joint in config.joints:
            setattr(self, f"on_{joint}_relax", partial(self.relax, joint))
            setattr(self, f"on_{joint}_enable", partial(self.enable, joint))
        for controller in config.controllers:
            setattr(self, f"accept_{controller}", self.accept)

    def configure(self) -> None:
        """Open the bus, real or simulated; nothing moves."""
        config, self.at_end = self.config, ExitStack()
        joints = {name: servo_joint(name, one) for name, one in config.joints.items()}
        self.faults: FaultScript | None = None
        self.period = 1.0 / config.rate
        policy = JointPolicy(cycle=self.period)
        rules = {name: JointRules(one.limits, one.is_continuous) for name, one in joints.items()}
        followers = {
            name: TrajectoryFollower({joint: rules[joint] for joint in one.joints}, TrajectoryPolicy())
            for name, one in config.controllers.items()
        }
        drives = {name: JointDrive(joint, policy) for name, joint in joints.items()}
        self.cycle = ServoCycle(self.opened(list(joints.values())), drives, followers)
        self.goals: dict[str, Any] = dict.fromkeys(config.controllers)
        self.is_stopped, self.lost_at = False, -math.inf
        self.told_at, self.published_at = -math.inf, -math.inf

    def opened(self, joints: list[ServoJoint]) -> Bus:
        """Return the bus: that of the port, or simulated servos."""
        config, models, path = self.config, {joint.id: joint.model for joint in joints}, self.config.port
        if config.twin:
            servos = twin_servos(joints, is_ideal=config.twin == "ideal", noise=config.noise, seed=config.seed)
            twin = self.at_end.enter_context(twin_of(servos, lambda: self.now, has_bytes=config.twin == "pty"))
            self.faults = FaultScript(config.faults.values(), servos, twin)
            if isinstance(twin, TwinBus):
                return twin
            path = str(twin.path)
        from rbxcompose.actuation.dynamixel_bus import DynamixelBus

        bus = DynamixelBus(path, models, baud=self.config.baud, clock=lambda: self.now)
        self.at_end.callback(bus.close)
        return bus

    def activate(self) -> None:
        """Begin the cycles."""
        if self.faults is not None:
            self.faults.start(self.now)
        self.wake()

    def wake(self) -> None:
        """Run one cycle, and prepare the next, on a grid."""
        self.context.wake_at((math.floor(self.now / self.period + 1e-6) + 1) * self.period)
        if self.faults is not None:
            self.faults.play(self.now)
        try:
            self.run_cycle()
        except PortError as error:
            self.lose(error)
        if self.now - self.told_at >= REPORT:
            self.told_at = self.now
            self.tell()

    def run_cycle(self) -> None:
        """Take new goals, run the cycle, end goals that are over, and publish."""
        if self.lost_at > -math.inf:
            if self.now - self.lost_at < REOPEN:
                return
            self.cycle.bus.reopen()
            for drive in self.cycle.drives.values():  # their servos have no torque now, and may be elsewhere
                drive.ask(Relax())
            self.info("the bus of servos is back")
            self.lost_at = -math.inf
        for name in self.goals:
            self.take(name)
        for name, outcome in self.cycle.run(self.now, self.period).items():
            self.end(name, outcome)
        if self.now - self.published_at >= 1 / PUBLISHED - 1e-9:
            self.published_at = self.now
            self.publish()

    def take(self, name: str) -> None:
        """Take over the newest goal of a controller, or its cancellation."""
        goal, follower = self.bound[name].current, self.cycle.followers[name]
        if goal is not None and goal.cancel_requested:
            follower.cancel(self.now)
            self.goals[name] = None
            goal.canceled(Follow.Result(error_string="canceled"))
        elif goal is not None and goal is not self.goals[name]:
            self.goals[name] = goal
            answer = self.cycle.accept(name, trajectory_of(goal.request, self.now, self.stamp), self.now)
            if isinstance(answer, TrajectoryRefusal):
                self.goals[name] = None
                goal.aborted(answer.message, Follow.Result(error_code=answer.code, error_string=answer.message))

    def end(self, name: str, outcome: TrajectoryOutcome) -> None:
        """End the goal of a controller as its trajectory ended."""
        goal: ServedGoal[Any, Any, Any] | None = self.goals[name]
        self.goals[name] = None
        if goal is None:
            return
        result = Follow.Result(error_code=outcome.code, error_string=outcome.message)
        if outcome.code == Follow.Result.SUCCESSFUL:
            goal.succeeded(result)
        else:
            goal.aborted(outcome.message, result)

    def accept(self, goal: Follow.Goal) -> str:
        """Refuse what moves while the robot is stopped, or its bus has gone."""
        return self.refusal()

    def refusal(self) -> str:
        """Return why nothing may move now, or nothing."""
        return "the robot is stopped" if self.is_stopped else GONE if self.lost_at > -math.inf else ""

    def received(self, port: str, message: Any) -> None:
        """Move one joint, unless a controller leads it."""
        name = port.removesuffix("_command")
        leader = next(
            (one for one, each in self.cycle.followers.items() if name in each.joints and each.is_following), ""
        )
        reason = f"controller '{leader}' leads it" if leader else self.refusal()
        if reason:
            self.cycle.drives[name].refused = reason
            return
        self.cycle.drives[name].ask(MoveTo(message.data))

    def relax(self, name: str, request: Trigger.Request) -> Trigger.Response:
        """Switch the torque of a joint off, until its next command."""
        self.cycle.drives[name].ask(Relax())
        return Trigger.Response(success=True)

    def enable(self, name: str, request: SetBool.Request) -> SetBool.Response:
        """Enable a joint; while it is disabled, it has no torque and commands are refused."""
        self.cycle.drives[name].ask(Enable(request.data))
        return SetBool.Response(success=True)

    @answers(InjectFault)
    def inject(self, request: InjectFault) -> str:
        """Let something go wrong with simulated servos."""
        if self.faults is None:
            raise Refused("real servos have their own faults")
        return self.faults.inject(request, self.now)

    def publish(self) -> None:
        """Publish where the joints are."""
        known = [one for one in self.cycle.drives.values() if math.isfinite(one.measured.position)]
        if known:
            self.joint_states(
                JointState(
                    header=Header(stamp=to_time(self.stamp)),
                    name=tuple(one.joint.name for one in known),
                    position=np.array([one.measured.position for one in known]),
                    velocity=np.array([one.measured.velocity for one in known]),
                )
            )

    def tell(self) -> None:
        """Report to diagnostics."""
        drives = self.cycle.drives
        notes = {name: one.condition.note or one.refused for name, one in drives.items()}
        notes = {name: words for name, words in notes.items() if words}
        bad = [name for name, one in drives.items() if one.mode in (JointMode.FAULT, JointMode.RESTING)]
        level = Level.ERROR if bad or self.lost_at > -math.inf else Level.WARN if notes else Level.OK
        message = "; ".join(f"{name}: {words}" for name, words in notes.items()) or f"{len(drives)} joints"
        self.status(level, message, **{name: one.mode for name, one in drives.items()})

    def lose(self, error: PortError) -> None:
        """Remember that the port has gone; trajectories end."""
        if self.lost_at == -math.inf:
            self.warn(str(error))
        self.lost_at = self.now
        self.halt(GONE)

    def halt(self, reason: str) -> None:
        """End all trajectories, and bring the joints to rest."""
        for name, outcome in self.cycle.halt(self.now, reason).items():
            self.end(name, outcome)
        for drive in self.cycle.drives.values():
            if drive.mode is JointMode.ACTIVE:
                drive.ask(Hold())

    @property
    def is_at_rest(self) -> bool:
        """Return whether no command moves."""
        return all(one.is_at_rest for one in self.cycle.drives.values())

    def stop(self) -> None:
        """Bring all joints to rest, and refuse what moves them."""
        self.is_stopped = True
        self.halt("the robot was stopped")

    def release(self) -> None:
        """Accept commands again."""
        self.is_stopped = False

    def brake(self) -> None:
        """Bring all joints to rest for good."""
        self.stop()

    def cleanup(self) -> None:
        """Relax the joints, unless they are to hold, and give the port back."""
        try:
            if self.config.on_shutdown == "relax":
                self.cycle.relax(self.now, self.period)
        except PortError as error:
            self.warn(f"the joints could not be relaxed: {error}")
        self.at_end.close()


def servo_joint(name: str, config: DrivenJointConfig) -> ServoJoint:
    """Return a joint with its servo. ValueError if there is no such model."""
    model = model_named(config.model)
    if model is None:
        raise ValueError(f"no servo is called '{config.model}'")
    neutral = model.family.centre if config.neutral is None else config.neutral
    limits = MotionLimits(config.lower, config.upper, config.velocity, config.acceleration)
    return ServoJoint(name, config.id, model, limits, neutral, config.invert)


def trajectory_of(goal: Follow.Goal, now: float, stamp: int) -> TrajectoryGoal:
    """Return a goal as the follower takes it; its stamp [ns] is by the clock of headers, a zero one is now."""
    begin = to_nanoseconds(goal.trajectory.header.stamp)
    points = tuple(
        TrajectoryPoint(
            seconds(one.time_from_start), tuple(one.positions), tuple(one.velocities), tuple(one.accelerations)
        )
        for one in goal.trajectory.points
    )
    paths = {one.name: one.position for one in goal.path_tolerance}
    ends = {one.name: (one.position, one.velocity) for one in goal.goal_tolerance}
    default = TrajectoryTolerance()
    tolerances = {
        name: TrajectoryTolerance(
            allowed(paths.get(name, 0.0), default.path),
            allowed(ends.get(name, (0.0, 0.0))[0], default.goal),
            allowed(ends.get(name, (0.0, 0.0))[1], default.velocity),
        )
        for name in {*paths, *ends}
    }
    return TrajectoryGoal(
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
