"""Drives a joint that slides up or down."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

from pydantic import Field

from rbxcompose.base.config import JointName
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.units import LENGTH, SPEED
from rbxcompose.domains.servos.controller import Controller, ControllerConfig, controller
from rbxcompose.domains.servos.limits import MotionLimits, stopping_speed
from rbxcompose.msgs.control_msgs import SingleJointPosition as Move
from rbxcompose.msgs.stamps import to_seconds, to_time
from rbxcompose.msgs.std_msgs import Float64, Header
from rbxcompose.sdk import BoundsGoals, Capability, In, Length, Port, ServedGoal, ServesAction, Setting, Speed, Time

MEASURES = {"position": LENGTH, "max_velocity": SPEED}


class LinearConfig(ControllerConfig):
    """Leads a joint that slides."""

    type: Literal["linear"] = "linear"
    """How it leads its joints."""
    joint: JointName
    """The joint that it leads."""
    speed: Speed = Field(gt=0)
    """How fast it goes."""
    dead_band: Length = Field(0.01, gt=0, le=0.1)
    """Within this of the wanted position it has arrived."""
    stall_after: Time = Field(2.0, gt=0)
    """Without progress for this long, it gives up."""

    @property
    def claimed(self) -> tuple[str, ...]:
        """Return the joint that it leads."""
        return (self.joint,)


@controller("linear")
class LinearController(Controller[LinearConfig]):
    """Drives a joint that slides to positions [m] at a set speed: a lift, for example.

    They come on the topic `NAME/command`, or as goals of the action `NAME/move` of ROS, which fail with the reason when
    the joint is stuck or may not move. It never leaves the limits of the joint.

    Example:
        lift: {type: linear, joint: lift_joint, speed: 2 cm/s, dead_band: 5 mm}
    """

    interface = "velocity"
    kinds = frozenset({"prismatic"})

    @classmethod
    def ports(cls, name: str, config: LinearConfig) -> dict[str, Port[Any]]:
        """Return its topic and its action."""
        return {
            "command": In(Float64, f"{name}/command", qos="command", is_open=True),
            "move": ServesAction(Move, f"{name}/move", claims=name, skill=name, measures=MEASURES),
        }

    @classmethod
    def capabilities(cls, name: str, config: LinearConfig) -> tuple[Capability, ...]:
        """Return that it refuses what its joint cannot reach."""
        led, speed = Setting({"position": config.joint}, "joint"), Setting(config.speed, "speed")
        return (BoundsGoals("move", joints=led, speed=speed),)

    def prepare(self) -> None:
        """Set up how it moves."""
        config = self.config
        self.joint = self.site.joints[config.joint]
        acceleration = self.joint.rules.limits.acceleration
        self.policy = LinearPolicy(config.speed, config.dead_band, config.stall_after, acceleration=acceleration)
        self.move: LinearMove | None = None
        self.followed: ServedGoal[Any, Any, Any] | None = None  # the goal to which it moves
        self.last = ""  # why the last command failed, was changed or refused

    @property
    def limits(self) -> MotionLimits:
        """Return where its joint may be."""
        return self.joint.rules.limits

    @property
    def leads(self) -> bool:
        """Return whether it moves."""
        return self.move is not None

    @property
    def note(self) -> str:
        """Return what became of the last command, unless it was done."""
        return self.last

    def accept(self, port: str, goal: Move.Goal) -> str:
        """Refuse what cannot be."""
        if not math.isfinite(goal.position):
            return f"the position {goal.position} is not a finite number"
        if not (math.isfinite(goal.max_velocity) and goal.max_velocity >= 0.0):
            return f"the velocity must be finite and not negative, not {goal.max_velocity} m/s"
        if self.limits.clamped(goal.position) != goal.position:
            return f"{goal.position:g} m is outside of {self.limits.least:g} m to {self.limits.greatest:g} m"
        return ""

    def received(self, port: str, message: Float64) -> None:
        """Go to a position, the nearest one that is within the limits."""
        if not math.isfinite(message.data):
            self.last = f"a command was refused: the position {message.data} is not a finite number"
            return
        self._end("a command came")
        wanted = self.limits.clamped(message.data)
        self.last = "" if wanted == message.data else f"{message.data:g} m was cut to {wanted:g} m"
        self._begin(wanted, self.policy, self.site.now)

    def cycle(self, now: float, dt: float) -> None:
        """Take over the newest goal, or its cancellation, and lead the joint."""
        self._take(now)
        if self.move is None:
            return
        if self.joint.blocked:
            self._end(f"joint '{self.config.joint}': {self.joint.blocked}")
            return
        velocity = self.move.step(self.joint.measured.position, now, dt)
        if self.move.is_over:
            self._end(self.move.failure)
        else:
            self.joint.turn(velocity)

    def publish(self) -> None:
        """Tell how far the goal is."""
        if self.followed is None or self.move is None:
            return
        at, header = self.joint.measured, Header(stamp=to_time(self.site.stamp))
        error = self.move.wanted - at.position
        self.followed.feedback(Move.Feedback(header=header, position=at.position, velocity=at.velocity, error=error))

    def halt(self, now: float, reason: str) -> None:
        """Stop."""
        self._end(reason)

    def _take(self, now: float) -> None:
        goal = self.site.goal("move")
        if goal is not None and goal.cancel_requested:
            self.move = self.followed = None
            goal.canceled()
        elif goal is not None and goal is not self.followed:
            asked: Move.Goal = goal.request
            way = abs(asked.position - self.joint.measured.position)
            speeds = [self.policy.speed]
            speeds += [asked.max_velocity] if asked.max_velocity > 0.0 else []
            speeds += [way / least] if way > 0.0 and (least := to_seconds(asked.min_duration)) > 0.0 else []
            self.followed, self.last = goal, ""
            self._begin(asked.position, replace(self.policy, speed=min(speeds)), now)

    def _begin(self, wanted: float, policy: LinearPolicy, now: float) -> None:
        position = self.joint.measured.position
        if self.joint.blocked or not math.isfinite(position):
            self.last = f"joint '{self.config.joint}': {self.joint.blocked or 'its position is not known'}"
            self._end(self.last)
        else:
            self.move = LinearMove(policy, wanted, position, now)

    def _end(self, failure: str) -> None:
        """Stop; without a failure it has arrived."""
        is_moving, goal = self.move is not None, self.followed
        self.move = self.followed = None
        if failure and (is_moving or goal is not None):
            self.last = failure
        if goal is not None:
            goal.aborted(failure) if failure else goal.succeeded()


CREEP = 0.1  # of its speed, below which it does not slow down before it has arrived
MOVES = 0.02  # of its speed: slower than this it is stuck


@dataclass(frozen=True, slots=True)
class LinearPolicy:
    """How a joint goes to a position. ValueError if it cannot."""

    speed: float
    """[m/s], above 0."""
    dead_band: float = 0.01
    """Within this of the wanted position it has arrived [m]."""
    stall_after: float = 2.0
    """Without progress for this long [s], it is stuck."""
    acceleration: float | None = None
    """With which it brakes [m/s^2]; None is at once."""

    def __post_init__(self) -> None:
        for what, value in (("speed", self.speed), ("dead band", self.dead_band), ("time", self.stall_after)):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"the {what} must be positive and finite, not {value}")


class LinearMove:
    """One way to a position.

    A joint that is within the dead band at the beginning does not move; one that moves goes on to the wanted position,
    not to the edge of the dead band.
    """

    def __init__(self, policy: LinearPolicy, wanted: float, position: float, now: float) -> None:
        self.policy, self.wanted = policy, wanted
        self.is_over = abs(wanted - position) <= policy.dead_band
        self.failure = ""
        """Why it ended before it had arrived."""
        self._direction = math.copysign(1.0, wanted - position)
        self._best, self._since = abs(wanted - position), now  # how near it came, and when [m, s]

    def step(self, position: float, now: float, dt: float) -> float:
        """Return with which velocity to move up to `now + dt` [m/s]; 0 when it is over."""
        gap = self.wanted - position
        has_passed, is_near = gap * self._direction <= 0.0, abs(gap) <= self.policy.dead_band
        self._watch(gap, now)
        if self.is_over or (has_passed and is_near):
            self.is_over = True
            return 0.0
        self._direction = math.copysign(1.0, gap)
        braking = stopping_speed(abs(gap), dt, self.policy.acceleration)
        return self._direction * min(self.policy.speed, max(braking, CREEP * self.policy.speed))

    def _watch(self, gap: float, now: float) -> None:
        """End when there is no progress."""
        policy = self.policy
        if abs(gap) < self._best - MOVES * policy.speed * policy.stall_after:
            self._best, self._since = abs(gap), now
        if now - self._since >= policy.stall_after and not self.is_over:
            self.is_over = True
            if abs(gap) > policy.dead_band:
                self.failure = f"it has not moved for {policy.stall_after:g} s, {abs(gap):.3g} m before its goal"
