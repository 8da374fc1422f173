"""The configuration of a bus of servos, and the drives of joints that it describes; all in SI."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal

from rbxcompose.base.config import Config
from rbxcompose.domains.servos.bus import DYNAMIXEL, bus_type
from rbxcompose.domains.servos.controller import ControllerConfig, controller_type
from rbxcompose.domains.servos.joint_drive import JointDrive, JointServo, PositionDrive, ServoJoint, VelocityDrive
from rbxcompose.domains.servos.joint_states import JointPolicy, ThermalPolicy
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.models import ServoModel, joint_effort, steepest
from rbxcompose.domains.servos.servo_cycle import JointMimic, ServoItem
from rbxcompose.domains.servos.transmission import Calibration, Gear, Measured
from rbxcompose.domains.servos.twins.servo_faults import TwinFault
from rbxcompose.msgs.rbxcompose_msgs import SetSpeed
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.sdk.ports import In, Port, Serves


class JointServoConfig(Config):
    """A servo of a joint."""

    id: int
    """Its id."""
    model: str
    """Its model."""
    neutral: int | None = None
    """The tick at angle 0; without it the middle of its range."""
    invert: bool = False
    """Whether it turns the other way round than the joint."""
    torque: float = 1.0
    """Share of its torque that it may use."""


class DrivenJointConfig(Config):
    """A joint and its servos, in radians, or in metres if it slides."""

    servos: list[JointServoConfig]
    """The servos that drive it together."""
    mode: Literal["position", "velocity"] = "position"
    """Whether they are given positions or velocities."""
    ratio: float = 1.0
    """Turns of a servo for each turn of the joint."""
    offset: float = 0.0
    """Position of the joint when its servos are at 0 [rad]."""
    calibration: list[tuple[float, float]] = []
    """Angles of a servo [rad] and positions of the joint, instead of a ratio."""
    is_continuous: bool = False
    """Whether it turns without end."""
    lower: float | None = None
    """Least position."""
    upper: float | None = None
    """Greatest position."""
    velocity: float | None = None
    """Largest speed."""
    acceleration: float | None = None
    """Largest acceleration."""
    mimic: str = ""
    """The joint that it follows instead of commands."""
    multiplier: float = 1.0
    """How far it moves for each radian or metre of that joint."""
    mimic_offset: float = 0.0
    """Where it is when that joint is at 0."""


class ControllerSetup(Config):
    """A controller: its type, and the settings of that type as a person writes them."""

    type: str
    """Its type."""
    settings: dict[str, Any] = {}
    """Settings of that type."""
    sliding: list[str] = []
    """Those of its joints that slide."""

    @property
    def config(self) -> ControllerConfig:
        """Return the settings as the configuration of the type."""
        return controller_type(self.type).config_type().model_validate(self.settings).with_sliding(self.sliding)


class ThermalConfig(Config):
    """When joints are too hot [degC], and how long they rest [s]."""

    warn: float = 50.0
    """Above this, people are told."""
    limit: float = 60.0
    """Above this, a joint loses its torque and rests."""
    resume: float = 45.0
    """It rests until it is at this or below."""
    rest: float = 60.0
    """It rests for this long at least."""
    scope: Literal["joint", "bus"] = "joint"
    """Whether a joint that is too hot rests alone, or all joints of its bus with it."""


class ServoBusConfig(Config):
    """A bus of servos, its joints and its controllers."""

    name: str = "servos"
    """Its name, which begins the topics of the services for all joints."""
    kind: str = DYNAMIXEL
    """What speaks on it."""
    port: str = ""
    """The serial port."""
    baud: int = 1_000_000
    """Bits per second."""
    rate: float = 100.0
    """Cycles per second."""
    fast: bool = False
    """Whether servos may answer together in one packet."""
    watchdog: float = 0.2
    """Silence of the bus after which servos stop by themselves, if they can [s]; 0 is never."""
    return_delay: float | None = None
    """Pause of servos before each reply, which is written into them [s]; None leaves theirs."""
    twin: Literal["", "ideal", "servo", "pty"] = ""
    """How its servos are simulated, if they are."""
    noise: float = 0.0
    """Standard deviation of the positions that simulated servos measure [rad]."""
    seed: int = 0
    """Repeats the noise."""
    faults: dict[str, TwinFault] = {}
    """What goes wrong with simulated servos, by names."""
    on_start: Literal["relax", "hold"] = "relax"
    """Whether joints have torque from the start."""
    on_shutdown: Literal["relax", "hold", "park"] = "relax"
    """What happens to torque at the end; `park` first moves to `park`."""
    park: dict[str, float] = {}
    """Where joints are parked."""
    park_time: float = 10.0
    """How long they may take to get there [s]."""
    start_speed: float | None = None
    """Largest speed of single commands, until a joint is given another one."""
    thermal: ThermalConfig = ThermalConfig()
    """When joints rest."""
    joints: dict[str, DrivenJointConfig] = {}
    """Joints by name."""
    controllers: dict[str, ControllerSetup] = {}
    """Controllers by name."""
    used: dict[str, JointServoConfig] = {}
    """Servos of which controllers use items, by the names of their actuators; they need not drive joints."""
    by_physics: bool = False
    """Whether a physics engine moves simulated servos; with `simulator: physics`, that is the default."""
    put_at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the odometry of a base begins: x, y [m] and heading [rad]. Default: where a simulated world puts it."""

    @property
    def models(self) -> dict[int, str]:
        """Return the names of the servos' models by id."""
        return {servo.id: servo.model for joint in self.joints.values() for servo in joint.servos}

    @property
    def efforts(self) -> dict[str, float | None]:
        """Return the most that the servos of each joint exert on it [Nm or N], None if that is not known."""
        found = dict[str, float | None]()
        for name, joint in self.joints.items():
            gear = steepest(joint.calibration) if joint.calibration else joint.ratio
            found[name] = joint_effort([self.model(servo.model) for servo in joint.servos], gear)
        return found

    @property
    def lone(self) -> dict[int, ServoModel]:
        """Return the models of servos that drive no joint, by id."""
        driving = {servo.id for joint in self.joints.values() for servo in joint.servos}
        return {config.id: self.model(config.model) for config in self.used.values() if config.id not in driving}

    def model(self, name: str) -> ServoModel:
        """Return a model of its servos. ValueError if there is none of that name."""
        found = bus_type(self.kind).model(name)
        if found is None:
            raise ValueError(f"no servo is called '{name}'")
        return found

    @property
    def policy(self) -> JointPolicy:
        """Return how joints are watched."""
        heat = self.thermal
        thermal = ThermalPolicy(heat.warn, heat.limit, heat.resume, heat.rest)
        cycle = 1.0 / self.rate
        return JointPolicy(cycle, fault_after=max(0.5, 3 * cycle), on_start=self.on_start, thermal=thermal)


def joint_ports(config: ServoBusConfig) -> dict[str, Port[Any]]:
    """Return the ports of each joint and those for all, by name."""
    found: dict[str, Port[Any]] = {
        "relax_all": Serves(Trigger, f"{config.name}/relax_all"),
        "enable_all": Serves(SetBool, f"{config.name}/enable_all"),
    }
    for name, joint in config.joints.items():
        if joint.mode == "position" and not joint.mimic:
            found[f"{name}_command"] = In(Float64, f"{name}/command", qos="command", is_open=True)
            found[f"{name}_set_speed"] = Serves(SetSpeed, f"{name}/set_speed", skill=f"set_speed_{name}")
        found[f"{name}_relax"] = Serves(Trigger, f"{name}/relax", skill=f"relax_{name}")
        found[f"{name}_enable"] = Serves(SetBool, f"{name}/enable", skill=f"enable_{name}")
        found[f"{name}_reboot"] = Serves(Trigger, f"{name}/reboot", skill=f"reboot_{name}")
    return found


def item_of(config: ServoBusConfig, actuator: str, name: str, is_read: bool, setup: Mapping[str, int]) -> ServoItem:
    """Return an item of a servo that a controller uses."""
    servo = config.used[actuator]
    return ServoItem(servo.id, config.model(servo.model), name, is_read, setup)


def drives_of(config: ServoBusConfig) -> dict[str, JointDrive]:
    """Return a drive for each joint."""
    policy, drives = config.policy, dict[str, JointDrive]()
    for name, joint_config in config.joints.items():
        servos = [_servo(each, config.model(each.model)) for each in joint_config.servos]
        joint = servo_joint(name, joint_config, servos)
        drives[name] = (
            VelocityDrive(joint, policy)
            if joint_config.mode == "velocity"
            else PositionDrive(joint, policy, config.start_speed)
        )
    return drives


def mimics_of(joints: Mapping[str, DrivenJointConfig]) -> dict[str, JointMimic]:
    """Return the joints that follow others."""
    return {
        name: JointMimic(item.mimic, item.multiplier, item.mimic_offset) for name, item in joints.items() if item.mimic
    }


def servo_joint(name: str, config: DrivenJointConfig, servos: Iterable[JointServo]) -> ServoJoint:
    """Return a joint with its servos. ValueError if the calibration is none."""
    limits = MotionLimits(config.lower, config.upper, config.velocity, config.acceleration)
    table = config.calibration
    transmission = Measured(Calibration(tuple(sorted(table)))) if table else Gear(config.ratio, config.offset)
    return ServoJoint(name, tuple(servos), limits, transmission, config.is_continuous, config.mode)


def _servo(config: JointServoConfig, model: ServoModel) -> JointServo:
    neutral = model.family.centre if config.neutral is None else config.neutral
    return JointServo(config.id, model, neutral, config.invert, config.torque)
