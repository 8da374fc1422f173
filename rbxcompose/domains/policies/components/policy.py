"""A network of the user that commands joints or the base: its file in ONNX, what it observes, what it may answer."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from operator import attrgetter
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.config import JointName, LocalFiles
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import NotRegularError, TooLargeError, read_regular
from rbxcompose.base.levels import Level
from rbxcompose.manifest.fields import FieldPath, TopicName
from rbxcompose.msgs import registry
from rbxcompose.msgs.arrays import filled
from rbxcompose.msgs.definitions import FieldShape
from rbxcompose.msgs.fields import NoFieldError, field_type
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.nav2_msgs import Wait
from rbxcompose.msgs.stamps import to_duration, to_seconds
from rbxcompose.msgs.std_msgs import Float64MultiArray
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint
from rbxcompose.msgs.types import Message
from rbxcompose.sdk.ports import BULK

LARGEST = 512 * 1024 * 1024  # [B] of a network
ROUNDING = 1e-6  # of a limit, by which a number of 32 bits may be beyond it
JOINT_STATE = "sensor_msgs/msg/JointState"
OF_JOINTS = ("position", "velocity", "effort")
MOST_NUMBERS = 10_000  # of one field
JOINTS, NUMBERS, VELOCITY = JointTrajectory.TYPE, Float64MultiArray.TYPE, Twist.TYPE
MESSAGES: Mapping[str, type[Message]] = {JOINTS: JointTrajectory, NUMBERS: Float64MultiArray, VELOCITY: Twist}
AXES = tuple(f"{kind}.{axis}" for kind in ("linear", "angular") for axis in "xyz")
PERIODS = 2.0  # of the rate, in which joints arrive if nothing else is said
PATIENCE = 2.0  # [s] beyond the deadline, in which a goal waits for an answer that can be sent


class PolicyNetworkError(ValueError):
    """Raised for a file that is no network of a policy, and for one that fails."""


class PolicyNetwork:
    """A network with one vector as its input, and one as its first output: both of the shape N or 1xN, of floats."""

    def __init__(self, path: Path) -> None:
        """Load it.

        Raises:
            PolicyNetworkError: if the file is no such network.
        """
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4  # what goes wrong is raised
        data = read_network(path)
        try:
            self._session: Any = onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # its errors have no common class
            raise PolicyNetworkError(f"'{path.name}' is no network in ONNX: {_first_line(error)}") from error
        inputs, outputs = self._session.get_inputs(), self._session.get_outputs()
        if len(inputs) != 1:
            raise PolicyNetworkError(f"it has {len(inputs)} inputs, and not one vector")
        self._input, self._output = inputs[0].name, outputs[0].name
        self._is_batch = len(inputs[0].shape) == 2
        self.takes = _length(inputs[0], "input")
        """How many numbers it takes; None if it does not say."""
        self.gives = _length(outputs[0], "output")
        """How many numbers it gives; None if it does not say."""

    def answer(self, vector: Sequence[float]) -> list[float]:
        """Return its answer to an observation.

        Raises:
            PolicyNetworkError: if it cannot be computed.
        """
        given = np.asarray([vector] if self._is_batch else vector, np.float32)
        try:
            found = self._session.run([self._output], {self._input: given})[0]
        except Exception as error:  # its errors have no common class
            raise PolicyNetworkError(f"the network fails: {_first_line(error)}") from error
        return [float(value) for value in np.ravel(found)]


def read_network(path: Path) -> bytes:
    """Return the contents of a file.

    Raises:
        PolicyNetworkError: if there is none, or it cannot be read.
    """
    try:
        return read_regular(path, LARGEST)
    except FileNotFoundError:
        raise PolicyNetworkError(f"there is no file '{path}'") from None
    except (NotRegularError, TooLargeError) as error:
        raise PolicyNetworkError(f"'{path.name}' cannot be used: {error}") from None
    except OSError as error:
        raise PolicyNetworkError(f"'{path.name}' cannot be read: {error.strerror}") from None


def _length(end: Any, what: str) -> int | None:
    shape = end.shape
    is_vector = len(shape) == 1 or (len(shape) == 2 and (shape[0] == 1 or not isinstance(shape[0], int)))
    if end.type != "tensor(float)" or not is_vector:
        written = "x".join(map(str, shape)) or "nothing"
        raise PolicyNetworkError(
            f"its {what} '{end.name}' is {end.type} of the shape {written}, and not floats N or 1xN"
        )
    return shape[-1] if isinstance(shape[-1], int) else None


def _first_line(error: Exception) -> str:
    return next(iter(str(error).splitlines()), type(error).__name__)[:120]


class PolicyOutputConfig(sdk.Config):
    """What a number of an answer may be, in SI; an answer with any other is refused."""

    least: float
    """The least value."""
    most: float
    """The greatest value."""
    jump: float = Field(gt=0)
    """How far from the value before, at first from 0; a joint from where it is at first, or if others have led it."""

    @field_validator("most")
    @classmethod
    def _is_more(cls, most: float, info: ValidationInfo) -> float:
        if "least" in info.data and most < info.data["least"]:
            raise ValueError(f"it is below 'least', {info.data['least']:g}")
        return most


@dataclass(slots=True)
class PolicyCore:
    """Judges answers, and says when what is commanded must rest."""

    limits: Mapping[str, PolicyOutputConfig]
    """By the name of each number of an answer, in its order."""
    deadline: float
    """[s] from an observation to its command, and from the last command until rest."""
    lag: float = math.inf
    """How many jumps a joint may be away from what was sent: if it is farther, somebody else leads it."""
    counts: dict[str, int] = field(default_factory=lambda: dict.fromkeys(("sent", "late", "refused", "unseen"), 0))
    """What became of answers since the policy was configured; `unseen` are times with nothing to observe."""
    last: tuple[float, ...] | None = None
    """What is sent; None at first, and after a rest."""
    sent_at: float = -math.inf

    def judge(self, answer: Sequence[float], start: Sequence[float], began: float, ended: float) -> str:
        """Return why an answer must not be sent, or nothing: then `last` is to be sent.

        `start` is where the first answer begins, and where joints are; times [s] are those of the observation and of
        the answer.
        """
        took = ended - began
        if took > self.deadline:
            self.counts["late"] += 1
            return f"an answer took {took * 1e3:.0f} ms, and is late after {self.deadline * 1e3:.0f} ms"
        if problem := self._problem(answer, self._before(start)):
            self.counts["refused"] += 1
            return problem
        pairs = zip(self.limits.values(), answer, strict=True)
        self.last, self.sent_at = tuple(min(max(value, limits.least), limits.most) for limits, value in pairs), ended
        self.counts["sent"] += 1
        return ""

    def _before(self, start: Sequence[float]) -> Sequence[float]:
        """Return what an answer must be near to."""
        if self.last is None:
            return start
        triples = zip(self.limits.values(), self.last, start, strict=True)
        return [last if abs(last - at) <= self.lag * limits.jump else at for limits, last, at in triples]

    def _problem(self, answer: Sequence[float], before: Sequence[float]) -> str:
        if len(answer) != len(self.limits):
            return f"an answer has {len(answer)} numbers, and not {len(self.limits)}"
        for (name, limits), value, old in zip(self.limits.items(), answer, before, strict=True):
            if not math.isfinite(value):
                return f"'{name}' is not finite"
            if not limits.least - _slack(limits.least) <= value <= limits.most + _slack(limits.most):
                return f"'{name}' is {value:.4g}, beyond {limits.least:g} to {limits.most:g}"
            if abs(value - old) > limits.jump + _slack(limits.jump, value):
                return f"'{name}' jumps from {old:.4g} to {value:.4g}, by more than {limits.jump:g}"
        return ""

    def must_rest(self, now: float) -> bool:
        """Return whether what is commanded must rest now: its last command was good too long ago; once."""
        if self.last is None or now - self.sent_at <= self.deadline:
            return False
        self.last = None
        return True

    def forget(self) -> bool:
        """Start again with the next answer; return whether something is commanded that must rest."""
        is_moving, self.last = self.last is not None, None
        return is_moving


def _slack(*values: float) -> float:
    return ROUNDING * max(map(abs, values))


class NothingObservedError(Exception):
    """Raised when a message does not have the numbers that are observed."""


class ObservationConfig(sdk.Config):
    """Numbers of one topic."""

    topic: TopicName
    """Where they come from."""
    message: sdk.MessageName = JOINT_STATE
    """The type of the topic."""
    joints: list[JointName] = []
    """The joints, in their order; only of joint states."""
    size: int = Field(1, ge=1, le=MOST_NUMBERS)
    """How many numbers each field has, if it is a list and not of joints."""
    fields: list[FieldPath] = Field(["position"], min_length=1, validate_default=True)
    """The fields in their order, such as `twist.twist.linear.x`: of joints each field of all joints, then the next."""
    timeout: sdk.Time = Field(0.5, gt=0)
    """A message that is older counts for nothing, and the policy gives no answer."""

    @field_validator("joints")
    @classmethod
    def _of_joint_states(cls, joints: list[str], info: ValidationInfo) -> list[str]:
        if joints and info.data.get("message", JOINT_STATE) != JOINT_STATE:
            raise ValueError(f"only {JOINT_STATE} has joints")
        if len(set(joints)) < len(joints):
            raise ValueError("a joint is there twice")
        return joints

    @field_validator("fields")
    @classmethod
    def _are_numbers(cls, fields: list[str], info: ValidationInfo) -> list[str]:
        message = info.data.get("message")
        for path in fields if message else ():
            if info.data.get("joints") and path not in OF_JOINTS:
                context = {"name": path, "valid": OF_JOINTS, "what": "fields of joints"}
                raise PydanticCustomError("field", "a joint has no field '{name}'", context)
            _require_numbers(str(message), path, info.data.get("size"))
        return fields

    @property
    def length(self) -> int:
        """Return how many numbers it is."""
        return len(self.fields) * (len(self.joints) or self.size)


def _require_numbers(message: str, path: str, size: int | None) -> None:
    try:
        found = field_type(message, path)
    except NoFieldError as error:
        context = {"name": error.name, "valid": tuple(error.fields), "what": f"'message' is {message}, with the fields"}
        raise PydanticCustomError("field", f"{error.message} has no field '{{name}}'", context) from None
    if found.is_message or found.base in ("string", "wstring"):
        raise PydanticCustomError("field", "'{path}' is a {type}, not numbers", {"path": path, "type": str(found)})
    length = {FieldShape.SINGLE: 1, FieldShape.ARRAY: found.length}.get(found.shape, size)
    if size is not None and length != size:
        help_text = f"an observation of its own with 'size: {length}' has all of them" if length != 1 else ""
        lengths = {"path": path, "length": length, "size": size, "help": help_text}
        raise PydanticCustomError("field", "'{path}' has {length} numbers, and not {size}", lengths)


def observed(config: ObservationConfig, message: Any) -> list[float]:
    """Return the numbers of a message.

    Raises:
        NothingObservedError: if it does not have them.
    """
    return list(_of_joints(config, message) if config.joints else _of_fields(config, message))


def _of_joints(config: ObservationConfig, message: Any) -> Iterator[float]:
    places = {name: place for place, name in enumerate(message.name)}
    for path in config.fields:
        values: Sequence[float] = getattr(message, path)
        for joint in config.joints:
            if (place := places.get(joint)) is None or place >= len(values):
                raise NothingObservedError(f"'{config.topic}' has no {path} of '{joint}'")
            yield float(values[place])


def _of_fields(config: ObservationConfig, message: Any) -> Iterator[float]:
    for path in config.fields:
        found = attrgetter(path)(message)
        values = [found] if isinstance(found, int | float) else list(found)
        if len(values) != config.size:
            raise NothingObservedError(f"'{path}' of '{config.topic}' has {len(values)} numbers, and not {config.size}")
        yield from map(float, values)


class PolicyCommandsConfig(sdk.Config):
    """Where answers go, and what they mean."""

    topic: TopicName
    """The topic of a controller (`arm/joint_trajectory`), or an input of a mux (`cmd_vel/policy`)."""
    message: sdk.MessageName = JOINTS
    """Its type: `trajectory_msgs/JointTrajectory`, `geometry_msgs/Twist` or `std_msgs/Float64MultiArray`."""
    within: sdk.Time | None = Field(None, gt=0)
    """In which time joints arrive at a position, and then rest; by default in two periods of the rate."""
    outputs: dict[str, PolicyOutputConfig] = Field(min_length=1)
    """The numbers of an answer in their order: joints, `linear.x` to `angular.z` of a velocity, or any words."""

    @field_validator("message")
    @classmethod
    def _is_understood(cls, message: str) -> str:
        if message not in MESSAGES:
            raise ValueError(f"answers are sent as {', '.join(MESSAGES)}")
        return message

    @field_validator("outputs")
    @classmethod
    def _are_axes(cls, outputs: dict[str, PolicyOutputConfig], info: ValidationInfo) -> dict[str, PolicyOutputConfig]:
        unknown = [name for name in outputs if name not in AXES]
        if info.data.get("message") == VELOCITY and unknown:
            raise ValueError(f"a velocity has no '{unknown[0]}', but {', '.join(AXES)}")
        return outputs


class PolicyConfig(sdk.Config):
    """The network, what it is given, and what its answers command."""

    model: LocalFiles = Field(min_length=1)
    """The network, a file in ONNX: relative to the robot's file, or a whole path on the robot's computer."""
    rate: sdk.Frequency = Field(10.0, gt=0, le=200)
    """How often it is asked."""
    deadline: sdk.Time = Field(0.2, gt=0, validate_default=True)
    """An answer that took longer is not sent; so long after the last one that was, what it commands comes to rest."""
    observes: list[ObservationConfig] = Field(min_length=1)
    """What it is given, in this order."""
    commands: PolicyCommandsConfig
    """What its answers command."""
    switch: TopicName = "policy/enable"
    """The service that switches it on and off."""
    action: TopicName = "run_policy"
    """The action that runs it for a time; its last word is the skill of missions."""
    starts: bool = False
    """Whether it is on as soon as the robot is up; after a stop, a failure, or `apply` of other settings it is off."""

    @field_validator("deadline")
    @classmethod
    def _is_longer_than_a_period(cls, deadline: float, info: ValidationInfo) -> float:
        if (rate := info.data.get("rate")) is not None and deadline <= 1.0 / rate:
            raise ValueError(
                f"at {rate:g} Hz there is an answer every {1e3 / rate:.0f} ms: it must be longer than that"
            )
        return deadline

    @field_validator("commands")
    @classmethod
    def _sees_what_it_moves(cls, commands: PolicyCommandsConfig, info: ValidationInfo) -> PolicyCommandsConfig:
        if commands.message == JOINTS and "observes" in info.data:
            blind = [joint for joint in commands.outputs if joint not in positions_in(info.data["observes"])]
            if blind:
                raise ValueError(
                    f"it must observe the position of '{blind[0]}' to command it: its first step is from there"
                )
        return commands


def positions_in(observes: list[ObservationConfig]) -> dict[str, tuple[int, int]]:
    """Return in which observation, and where in it, the position of each joint is."""
    found: dict[str, tuple[int, int]] = {}
    for number, seen in enumerate(observes):
        if seen.message == JOINT_STATE and "position" in seen.fields:
            first = seen.fields.index("position") * len(seen.joints)
            found |= {joint: (number, first + place) for place, joint in enumerate(seen.joints)}
    return found


@sdk.component("policy")
class Policy(sdk.Component[PolicyConfig]):
    """Runs a network in ONNX that observes joints or other numbers, and commands a controller or an input of a mux.

    Nothing is sent that is late, not finite, or beyond the limits of `outputs`. The skill `run_policy: 30 s` runs it
    for a time and leaves it off, and fails where no answer can be sent. Its service, such as the skill `enable`,
    switches it on until something switches it off.

    Example:
        reach: {type: policy, model: /opt/models/reach.onnx,
          observes: [{topic: odom, message: nav_msgs/Odometry, fields: [twist.twist.linear.x]}],
          commands: {topic: cmd_vel/policy, message: geometry_msgs/Twist,
            outputs: {linear.x: {least: -0.1, most: 0.3, jump: 0.05}}}}
    """

    process = "policy"
    blocking = True

    @classmethod
    def rate_of(cls, config: PolicyConfig) -> float:
        """Return how often it is asked [Hz]."""
        return config.rate

    @classmethod
    def ports(cls, config: PolicyConfig) -> dict[str, sdk.Port[Any]]:
        """Return what it observes and commands, and its switch."""
        inputs: dict[str, sdk.Port[Any]] = {
            name: sdk.In(registry.message(seen.message), seen.topic, is_open=True, limits=BULK).named(name)
            for name, seen in _observed(config).items()
        }
        kind = MESSAGES[config.commands.message]
        commands: sdk.Port[Any] = sdk.Out(kind, config.commands.topic, qos=_quality(config))
        return {
            **inputs,
            "commands": commands.named("commands"),
            "switch": sdk.Serves(SetBool, config.switch).named("switch"),
            "run": sdk.ServesAction(Wait, config.action, claims=_claimed(config.commands), pausable=True).named("run"),
        }

    @classmethod
    def capabilities(cls, config: PolicyConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it needs, and how fast it drives."""
        needed = sdk.NeedsExtra(sdk.Setting("onnxruntime"), sdk.Setting("policy"))
        if config.commands.message != VELOCITY:
            return (needed,)
        speed, turn_rate = (_greatest(config, name) for name in ("linear.x", "angular.z"))
        return needed, sdk.CommandsMotion("commands", sdk.Setting(speed), sdk.Setting(turn_rate))

    @property
    def within(self) -> float:
        """Return in which time joints arrive [s]."""
        return self.config.commands.within or PERIODS / self.config.rate

    def configure(self) -> None:
        """Load the network; if it is none, that is reported."""
        config = self.config
        is_of_joints = config.commands.message == JOINTS
        lag = (self.within + config.deadline) * config.rate if is_of_joints else math.inf
        self.core = PolicyCore(config.commands.outputs, config.deadline, lag)
        self.observations = _observed(config)
        self.newest: dict[str, tuple[float, Any]] = {}
        self.is_on, self.problem = False, ""
        self.goal: sdk.ServedGoal[Wait.Goal, Wait.Result, Wait.Feedback] | None = None
        self.ran, self.awaits = 0.0, 0.0  # [s] how long the goal has run, and since when it waits for an answer
        self.begins = config.starts and not self.context.is_again
        self.network: PolicyNetwork | None = None
        try:
            self.network = PolicyNetwork(Path(config.model))
        except PolicyNetworkError as error:
            self.problem = str(error)
            self.warn(self.problem)

    def start(self) -> None:
        """Begin if it is to begin by itself."""
        self.is_on = self.begins and not self.context.is_stopped

    def take_over(self, old: Policy) -> None:
        """Be off: the old one may have been."""
        self.begins = False

    def received(self, port: str, message: Any) -> None:
        """Keep the newest message of each topic."""
        self.newest[port] = self.now, message

    def on_switch(self, request: SetBool.Request) -> SetBool.Response:
        """Switch it on or off."""
        if request.data and self.network is None:
            return SetBool.Response(success=False, message=self.problem)
        if request.data and self.context.is_stopped:
            return SetBool.Response(success=False, message="the robot is stopped")
        if not request.data:
            self.rest()
        self.is_on = request.data
        return SetBool.Response(success=True)

    def step(self, dt: float) -> None:
        """Ask the network, and send its answer if that may be."""
        self.begin_goal()
        if self.network is None:
            self.status(Level.ERROR, self.problem)
            if self.goal is not None:
                self.goal.aborted(self.problem)
            return
        is_paused = self.goal is not None and self.goal.is_paused
        if is_paused:
            self.rest()
            self.awaits = self.now
        problem = self.ask(self.network) if self.is_on and not is_paused else ""
        if self.core.must_rest(self.now):
            self.send_rest()
        if self.goal is not None:
            self.ran += 0.0 if is_paused else dt
            self.pursue(self.goal, problem)
        words = problem or ("is off" if not self.is_on else "is paused" if is_paused else "sends")
        is_silent = bool(problem) and self.core.last is None
        level = Level.ERROR if is_silent else Level.WARN if problem else Level.OK
        self.status(level, words, **self.core.counts)

    def begin_goal(self) -> None:
        """Be on as soon as there is a goal; a newer one replaces it."""
        goal = self.bound["run"].current
        if goal is not self.goal:
            self.goal, self.ran, self.awaits = goal, 0.0, self.now
            self.is_on = goal is not None
            if goal is None:
                self.rest()

    def pursue(self, goal: sdk.ServedGoal[Wait.Goal, Wait.Result, Wait.Feedback], problem: str) -> None:
        """End a goal that is over, and be off with it."""
        left = to_seconds(goal.request.time) - self.ran
        if goal.cancel_requested:
            self.end_goal()
            goal.canceled()
        elif not self.is_on:
            self.end_goal()
            goal.aborted("the policy has been switched off")
        elif left < ROUNDING:
            self.end_goal()
            goal.succeeded(Wait.Result(total_elapsed_time=to_duration(self.ran)))
        elif self.now - max(self.core.sent_at, self.awaits) > self.config.deadline + PATIENCE:
            self.end_goal()
            goal.aborted(problem)
        else:
            goal.feedback(Wait.Feedback(time_left=to_duration(left)))

    def end_goal(self) -> None:
        """Be off, at rest, and without a goal."""
        self.goal = None
        self.stop()

    def ask(self, network: PolicyNetwork) -> str:
        """Send the answer to what is observed now; return why not, or nothing."""
        began = self.now
        try:
            parts = self.observe(began)
        except NothingObservedError as error:
            self.core.counts["unseen"] += 1
            return str(error)
        try:
            answer = network.answer([number for part in parts for number in part])
        except PolicyNetworkError as error:
            self.core.counts["refused"] += 1
            return str(error)
        if self.context.is_stopped:
            return "the robot is stopped"
        problem = self.core.judge(answer, self.beginning(parts), began, self.now)
        if not problem and self.core.last is not None:
            self.bound["commands"](self.command(self.core.last))
        return problem

    def observe(self, now: float) -> list[list[float]]:
        """Return the numbers of each observation.

        Raises:
            NothingObservedError: if one is missing or old.
        """
        parts = []
        for port, seen in self.observations.items():
            came, message = self.newest.get(port, (None, None))
            if came is None or now - came > seen.timeout:
                raise NothingObservedError(f"nothing comes on '{seen.topic}'")
            parts.append(observed(seen, message))
        return parts

    def beginning(self, parts: list[list[float]]) -> list[float]:
        """Return where joints are, and 0 for other numbers: what the first answer must be near to."""
        known = positions_in(self.config.observes) if self.config.commands.message == JOINTS else {}
        places = [known.get(name) for name in self.core.limits]
        return [parts[place[0]][place[1]] if place else 0.0 for place in places]

    def command(self, answer: tuple[float, ...]) -> Message:
        """Return an answer as a message."""
        commands = self.config.commands
        if commands.message == JOINTS:
            point = JointTrajectoryPoint(positions=filled("float64", answer), time_from_start=to_duration(self.within))
            return JointTrajectory(joint_names=tuple(commands.outputs), points=(point,))
        if commands.message == NUMBERS:
            return Float64MultiArray(data=filled("float64", answer))
        axes = dict(zip(commands.outputs, answer, strict=True))
        linear, angular = (
            Vector3(*(axes.get(f"{kind}.{axis}", 0.0) for axis in "xyz")) for kind in ("linear", "angular")
        )
        return Twist(linear=linear, angular=angular)

    def rest(self) -> None:
        """Bring what it commands to rest, if it commands anything."""
        if self.core.forget():
            self.send_rest()

    def send_rest(self) -> None:
        """Command rest once: no velocity, or a trajectory without points; numbers have no meaning that we know."""
        if self.config.commands.message == VELOCITY:
            self.bound["commands"](Twist())
        elif self.config.commands.message == JOINTS:
            self.bound["commands"](JointTrajectory(joint_names=tuple(self.config.commands.outputs)))

    def stop(self) -> None:
        """Be off, until somebody switches it on again."""
        self.is_on = False
        self.rest()

    def hold(self) -> None:
        """Command rest: no step follows while robot time stands still."""
        self.rest()

    def brake(self) -> None:
        """Be off for good."""
        self.stop()


def _observed(config: PolicyConfig) -> dict[str, ObservationConfig]:
    """Return the observations by the names of their ports."""
    return {f"observed_{number}": seen for number, seen in enumerate(config.observes, 1)}


def _claimed(commands: PolicyCommandsConfig) -> str:
    """Return what a goal claims: the base, or the controller or mux that it commands."""
    return "base" if commands.message == VELOCITY else commands.topic.partition("/")[0]


def _quality(config: PolicyConfig) -> str:
    return "state" if config.commands.message == JOINTS else "command"


def _greatest(config: PolicyConfig, name: str) -> float:
    output = config.commands.outputs.get(name)
    return max(abs(output.least), abs(output.most)) if output else 0.0
