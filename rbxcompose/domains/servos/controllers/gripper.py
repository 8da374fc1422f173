"""Opens and closes a gripper."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from pydantic import Field

from rbxcompose.base.config import Angle, Config, JointName, Length, Speed, Time
from rbxcompose.base.units import ANGLE, LENGTH, format_quantity
from rbxcompose.domains.servos import gripper
from rbxcompose.domains.servos.controller import Controller, ControllerConfig, controller
from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.domains.servos.transmission import Calibration
from rbxcompose.msgs.control_msgs import GripperCommand
from rbxcompose.msgs.rbxcompose_msgs import Grip
from rbxcompose.msgs.types import Message
from rbxcompose.sdk import BoundsGoals, Capability, Port, ServedGoal, ServesAction, Setting

COMMAND, GRIP = "command", "grip"  # the ports
_FINGERS = ("pad_width", "finger_length", "opening")
NEEDED: Mapping[str, tuple[str, ...]] = {
    "one_sided": ("joint", *_FINGERS),
    "dual": ("left", "right", *_FINGERS),
    "parallel": ("joint", "travel", "opening"),
    "sliding": ("joint", "opening"),
    "calibrated": ("joint", "calibration"),
}
"""The keys of each model."""
OPTIONAL: Mapping[str, tuple[str, ...]] = {
    "one_sided": ("center", "invert"),
    "dual": ("center_left", "center_right", "invert_left", "invert_right"),
    "parallel": ("center", "invert"),
    "sliding": (),
    "calibrated": (),
}


class StallConfig(Config):
    """When a gripper that does not get on has stalled."""

    progress: Length = Field(0.001, gt=0)
    """It has stalled if its opening changes less than this."""
    window: Time = Field(1.0, gt=0)
    """Within this time."""


class OpeningAtAngle(Config):
    """How far a gripper is open at an angle of its joint."""

    opening: Length = Field(ge=0)
    """Distance between the pads."""
    angle: Angle
    """Angle of the joint."""


class GripperConfig(ControllerConfig):
    """Opens and closes a gripper."""

    type: Literal["gripper"] = "gripper"
    """How it leads its joints."""
    model: Literal["one_sided", "dual", "parallel", "sliding", "calibrated"]
    """One finger turns, two fingers turn, both pads move in parallel, two fingers slide, or openings were measured."""
    joint: JointName | None = None
    """The joint that opens it; if fingers slide, that of one of them, which goes half of the opening."""
    left: JointName | None = None
    """The joint of the left finger of a `dual` gripper; positive opens."""
    right: JointName | None = None
    """The joint of the right finger; negative opens."""
    pad_width: Length | None = None
    """Opening with parallel fingers."""
    finger_length: Length | None = None
    """From the axis of a finger to its pad; half of that for `one_sided`, as in ArbotiX."""
    opening: tuple[Length, Length] | None = None
    """Least and greatest opening."""
    center: Angle | None = None
    """Angle of the joint with parallel fingers, or when closed if the pads move in parallel."""
    center_left: Angle | None = None
    """Angle of the left joint with parallel fingers."""
    center_right: Angle | None = None
    """Angle of the right joint with parallel fingers."""
    invert: bool | None = None
    """Whether the joint opens the other way."""
    invert_left: bool | None = None
    """Whether the left joint opens the other way."""
    invert_right: bool | None = None
    """Whether the right joint opens the other way."""
    travel: Length | None = Field(None, gt=0)
    """How far a `parallel` gripper opens for each turn of its joint."""
    calibration: list[OpeningAtAngle] | None = None
    """Measured openings and angles; straight lines between them."""
    tolerance: Length = Field(0.002, gt=0)
    """Within this of the wanted opening it has arrived."""
    stall: StallConfig = StallConfig()
    """When it has stalled, which is how it holds an object."""
    on_stall: Literal["success", "fail"] = "success"
    """Whether that is what was wanted."""
    press: Length = Field(0.005, ge=0)
    """How far beyond the surface of an object it goes on pressing."""
    speed: Speed | None = Field(None, gt=0)
    """Largest speed of the opening; without it, as fast as the joints may."""

    @property
    def claimed(self) -> tuple[str, ...]:
        """Return the joints that it leads."""
        return tuple(name for name in (self.joint, self.left, self.right) if name is not None)


@controller("gripper")
class GripperController(Controller[GripperConfig]):
    """Opens and closes a gripper, by the action `NAME/gripper_cmd` of ROS, or by `NAME/grip`.

    The newest goal leads. A goal ends when the gripper is as far open as wanted, or when it gets on no more: it holds
    an object then, and presses no farther than `press`. Nothing measures the force, so that `max_effort` has no
    effect; `effort` is the load of the servo.

    Example:
        hand:
          type: gripper
          model: one_sided
          joint: finger_joint
          pad_width: 1 cm
          finger_length: 8 cm
          opening: [0 cm, 9 cm]
    """

    @classmethod
    def ports(cls, name: str, config: GripperConfig) -> dict[str, Port[Any]]:
        """Return both actions."""
        counts_as = "success" if config.on_stall == "success" else "failure"
        return {
            COMMAND: ServesAction(GripperCommand, f"{name}/gripper_cmd", claims=name, skill=None),
            GRIP: ServesAction(
                Grip,
                f"{name}/grip",
                claims=name,
                skill=name,
                measures={"opening": LENGTH},
                outcomes={"stalled": counts_as},
            ),
        }

    @classmethod
    def capabilities(cls, name: str, config: GripperConfig) -> tuple[Capability, ...]:
        """Return that it refuses to open farther than its model can."""
        field = "calibration" if config.calibration is not None else "opening"
        return (BoundsGoals(GRIP, ranges=Setting({"opening": model_of(config).openings}, field)),)

    @classmethod
    def mistake(cls, config: GripperConfig) -> tuple[str, str] | None:
        """Return what belongs to another model, is missing, or cannot be."""
        own = NEEDED[config.model] + OPTIONAL[config.model]
        for key in dict.fromkeys(key for keys in (*NEEDED.values(), *OPTIONAL.values()) for key in keys):
            if key not in own and getattr(config, key) is not None:
                there = " and ".join(name for name in NEEDED if key in NEEDED[name] + OPTIONAL[name])
                return key, f"'{key}' is a key of the model {there}, not of {config.model}"
        for key in NEEDED[config.model]:
            if getattr(config, key) is None:
                return "model", f"a gripper of the model {config.model} needs the key '{key}'"
        if config.left is not None and config.left == config.right:
            return "right", f"'{config.right}' cannot turn both fingers"
        try:
            least, greatest = model_of(config).openings
        except ValueError as error:
            return "calibration" if config.calibration is not None else "opening", str(error)
        if config.tolerance >= greatest - least:
            return "tolerance", f"it opens from {least:g} m to {greatest:g} m: all of it is within the tolerance"
        if config.speed is not None and config.speed * config.stall.window <= config.stall.progress:
            return "speed", "it would be so slow that it seems to have stalled"
        return None

    @classmethod
    def kinds_for(cls, config: GripperConfig) -> frozenset[str]:
        """Return that fingers that slide have a joint that slides."""
        return frozenset({"prismatic"}) if config.model == "sliding" else cls.kinds

    @classmethod
    def asks(cls, config: GripperConfig) -> dict[str, tuple[float, float]]:
        """Return the range of angles of each joint."""
        model = model_of(config)
        ends = zip(*(model.angles(opening) for opening in model.openings), strict=True)
        return {name: (min(pair), max(pair)) for name, pair in zip(config.claimed, ends, strict=True)}

    def prepare(self) -> None:
        """Set up the model."""
        config = self.config
        self.model = model_of(config)
        self.policy = gripper.GripPolicy(config.tolerance, config.stall.progress, config.stall.window, config.on_stall)
        self.joints = [self.site.joints[name] for name in config.claimed]
        self.goal: ServedGoal[Any, Any, Any] | None = None  # that of the attempt
        self.port, self.wanted, self.at = GRIP, 0.0, 0.0  # the last two are openings [m]
        self.attempt = gripper.GripAttempt(self.model, self.model.openings[0], self.policy)

    @property
    def leads(self) -> bool:
        """Return whether it opens or closes."""
        return self.goal is not None

    def accept(self, port: str, goal: Any) -> str:
        """Refuse an opening that cannot be, or replace what leads the joints."""
        try:
            self.model.angles(opening_of(port, goal))
        except ValueError as error:
            return str(error)
        for other in (COMMAND, GRIP):
            if (replaced := self.site.goal(other)) is None:
                continue
            if replaced.cancel_requested:
                replaced.canceled(result_of(other, self._outcome("canceled")))
            else:
                outcome = self._outcome(f"replaced by a newer goal of '{port}'")
                replaced.aborted(outcome.message, result_of(other, outcome))
        self.goal = None
        return ""

    def cycle(self, now: float, dt: float) -> None:
        """Take over the newest goal, or its cancellation, and lead the joints."""
        for port in (COMMAND, GRIP):
            self._take(port)
        if self.goal is None:
            return
        if reason := self._obstacle():
            self._end(self._outcome(reason))
            return
        angles = [joint.measured.position for joint in self.joints]
        outcome = self.attempt.step(now, angles, self._effort())
        if outcome is None:
            self._lead(dt)
        elif outcome.reached_goal:
            self._follow(self.wanted)
        else:
            self._press(outcome.position)
        self._end(outcome)

    def publish(self) -> None:
        """Tell how far it is open, while it moves."""
        if self.goal is not None and math.isfinite(opening := self._opening()):
            command = GripperCommand.Feedback(position=opening, effort=self._effort())
            self.goal.feedback(command if self.port == COMMAND else Grip.Feedback(opening=opening))

    def halt(self, now: float, reason: str) -> None:
        """End the goal; the gripper stays as far open as it is."""
        if self.goal is not None:
            self._hold()
            self._end(self._outcome(reason))

    def _take(self, port: str) -> None:
        goal = self.site.goal(port)
        if goal is None:
            return
        if goal.cancel_requested:
            if goal is self.goal:
                self._hold()
                self.goal = None
            goal.canceled(result_of(port, self._outcome("canceled")))
        elif goal is not self.goal:
            self.goal, self.port, self.wanted = goal, port, opening_of(port, goal.request)
            self.attempt = gripper.GripAttempt(self.model, self.wanted, self.policy)
            self.at = self.model.opening([joint.commanded.position for joint in self.joints])

    def _obstacle(self) -> str:
        """Return why it cannot move, or nothing."""
        for name, joint in self.site.joints.items():
            if joint.blocked:
                return f"joint '{name}': {joint.blocked}"
            if not math.isfinite(joint.measured.position):
                return f"it is not known where joint '{name}' is"
        return ""

    def _lead(self, dt: float) -> None:
        """Go on to the wanted opening, no faster than permitted."""
        if self.config.speed is None:
            self._follow(self.wanted)
            return
        most, before = self.config.speed * dt, self.model.angles(self.at)
        self.at += max(-most, min(most, self.wanted - self.at))
        self._follow(self.at, before, dt if self.at != self.wanted else math.inf)

    def _follow(self, opening: float, before: tuple[float, ...] = (), dt: float = math.inf) -> None:
        """Be as far open at the end of the cycle, and pass there as fast as from the angles `before` within `dt`."""
        angles = self.model.angles(opening)
        for joint, angle, last in zip(self.joints, angles, before or angles, strict=True):
            joint.follow(JointSample(angle, (angle - last) / dt))

    def _press(self, surface: float) -> None:
        """Press against an object whose surface is at an opening; no farther than permitted, so that nothing burns."""
        beyond = self.config.press if self.config.on_stall == "success" else 0.0
        self._follow(surface + max(-beyond, min(beyond, self.wanted - surface)))

    def _hold(self) -> None:
        for joint in self.joints:
            joint.hold()

    def _opening(self) -> float:
        angles = [joint.measured.position for joint in self.joints]
        return self.model.opening(angles) if all(map(math.isfinite, angles)) else math.nan

    def _effort(self) -> float:
        return max((abs(joint.effort) for joint in self.joints if math.isfinite(joint.effort)), default=0.0)

    def _outcome(self, reason: str) -> gripper.GripOutcome:
        opening = self._opening()
        known = opening if math.isfinite(opening) else 0.0  # viewers of results take numbers only
        return gripper.GripOutcome(known, self._effort(), False, False, False, reason)

    def _end(self, outcome: gripper.GripOutcome | None) -> None:
        goal = self.goal
        if outcome is None or goal is None:
            return
        self.goal = None
        result = result_of(self.port, outcome)
        if outcome.is_success:
            goal.succeeded(result)
        else:
            goal.aborted(outcome.message, result)


def _turned_back(pairs: Sequence[tuple[float, float]]) -> str:
    """Return where a servo turns back while its gripper opens, nothing if it does not; pairs are opening and angle."""
    for pair, middle, other in zip(pairs, pairs[1:], pairs[2:], strict=False):
        if (middle[1] - pair[1]) * (other[1] - middle[1]) < 0.0:
            near, far = (
                f"{format_quantity(at, ANGLE)} at {format_quantity(wide, LENGTH)}" for wide, at in (middle, other)
            )
            return f"as it opens, the servo turns one way only, but {far} follows {near}"
    return ""


def model_of(config: GripperConfig) -> gripper.GripperModel:
    """Return the model of a gripper. ValueError with the reason if it cannot be."""
    if config.calibration is not None:
        pairs = sorted((one.opening, one.angle) for one in config.calibration)
        if back := _turned_back(pairs):
            raise ValueError(back)
        return gripper.CalibratedGripper(Calibration(tuple(pairs)))
    least, greatest = config.opening or (0.0, 0.0)
    center, invert = config.center or 0.0, bool(config.invert)
    if config.travel is not None:
        return gripper.ParallelGripper((-1.0 if invert else 1.0) * math.tau / config.travel, center, least, greatest)
    if config.model == "sliding":
        return gripper.ParallelGripper(0.5, 0.0, least, greatest)  # each finger goes half of the way
    fingers = gripper.FingerGeometry(config.pad_width or 0.0, config.finger_length or 0.0, least, greatest)
    if config.model == "one_sided":
        return gripper.FingerGripper(fingers, (center,), (invert,))
    centers = (config.center_left or 0.0, config.center_right or 0.0)
    return gripper.FingerGripper(fingers, centers, (bool(config.invert_left), bool(config.invert_right)))


def opening_of(port: str, goal: Any) -> float:
    """Return the opening that a goal at a port wants [m]."""
    wanted = goal.command.position if port == COMMAND else goal.opening
    return float(wanted)


def result_of(port: str, outcome: gripper.GripOutcome) -> Message:
    """Return how a goal at a port has ended."""
    if port == COMMAND:
        return GripperCommand.Result(
            position=outcome.position, effort=outcome.effort, stalled=outcome.stalled, reached_goal=outcome.reached_goal
        )
    return Grip.Result(
        opening=outcome.position,
        reached=outcome.reached_goal,
        stalled=outcome.stalled,
        outcome="stalled" if outcome.stalled else "",
        message=outcome.message,
    )
