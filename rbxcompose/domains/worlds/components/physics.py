"""A robot with masses, friction and motors in its world, by MuJoCo."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import AT_REST, Pose2, Transform3, Velocity2
from rbxcompose.base.levels import Level
from rbxcompose.domains.body.urdf import body_of
from rbxcompose.domains.worlds.inertial import imu_message
from rbxcompose.domains.worlds.optics import TO_OPTICAL, depth_message, optical_frame, picture_message
from rbxcompose.domains.worlds.physics.conversion import GROUND
from rbxcompose.domains.worlds.physics.engine import PhysicsWorld
from rbxcompose.domains.worlds.physics.looks import DepthPicture, PhysicsCamera
from rbxcompose.domains.worlds.physics.robot import PhysicsRobot, outline_body
from rbxcompose.domains.worlds.sensors import OTHERS
from rbxcompose.domains.worlds.shapes import ShapePath
from rbxcompose.domains.worlds.world import MAP_FRAME, world_of
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import message_of, transform_message, twist_message
from rbxcompose.msgs.rbxcompose_msgs import World, WorldRobots
from rbxcompose.msgs.sensor_msgs import Image, Imu, JointState
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Empty, Header, String
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.ports import BULK

ODOM, BASE = "odom", "base_footprint"
COMMANDED: dict[str, sdk.Port[Any]] = {
    "command": sdk.In(geometry.Twist, "physics/cmd_vel", qos="command").named("command")
}
FOR_SERVOS: dict[str, sdk.Port[Any]] = {
    "set_points": sdk.In(JointState, "physics/set_points").named("set_points"),
    "joints": sdk.Out(JointState, "physics/joint_states").named("joints"),
}
SILENCE = 0.5  # [s] without a command after which the wheels stand
SLOWEST = 0.1  # [s] between set points, at most


class PhysicsSensor(sdk.Config):
    """A camera or an inertial sensor on the robot."""

    frame: str
    """The link that it is on."""
    view: tuple[int, int, float] | None = None
    """Of a camera: width and height of its pictures in pixels, and from its left to its right edge [rad]."""

    @property
    def camera(self) -> PhysicsCamera | None:
        """Return it as a camera, if it is one."""
        if self.view is None:
            return None
        turned = Transform3() if optical_frame(self.frame) == self.frame else TO_OPTICAL
        return PhysicsCamera(self.frame, *self.view, turned)


class PhysicsConfig(sdk.Config):
    """The robot, and how it is simulated."""

    urdf: str = ""
    """Text of the URDF of its body; empty for one of which only the outline is known."""
    meshes: dict[str, str] = {}
    """The mesh files that exist, by their names in the URDF."""
    drives: bool = True
    """Whether it drives; otherwise it is fixed to the ground."""
    commanded: bool = True
    """Whether a base commands its wheels as a whole; otherwise servos turn them, if it drives."""
    wheel_distance: float = 0.23
    """Between the wheels that are added to a body without any [m]."""
    servos: dict[str, float | None] = {}
    """Joints that simulated servos drive, and the most that they exert [Nm or N]; None is what the URDF says."""
    sensors: dict[str, PhysicsSensor] = {}
    """What measures on it, by topic."""
    rate: Annotated[sdk.Frequency, Field(ge=10, le=1000)] = 100.0
    """How often it publishes where everything is; the engine itself takes steps of 2 ms."""


@sdk.component("physics")
class PhysicsSim(sdk.Component[PhysicsConfig]):
    """Moves the robot and what it pushes, with masses, friction and motors that stall and slip.

    Example:
        engine: {type: physics}
    """

    made_by = "The key `simulator: physics` runs it."
    process = "world"
    simulated = True
    world = sdk.In(World, "world", qos="latched", limits=BULK)
    measured = sdk.Out(Odometry, "physics/odom")
    truth = sdk.Out(Odometry, "ground_truth")
    contact = sdk.Out(String, "contact", qos="event")
    moved = sdk.Out(TFMessage, "world/moved")
    others = sdk.In(WorldRobots, OTHERS, is_open=True, may_be_silent=True)

    @classmethod
    def rate_of(cls, config: PhysicsConfig) -> float:
        """Return how often it publishes [Hz]."""
        return config.rate

    @classmethod
    def ports(cls, config: PhysicsConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with those for a base, for servos and for sensors if there are any."""
        found = super().ports(config) | (COMMANDED if config.commanded else {}) | (FOR_SERVOS if config.servos else {})
        for topic, sensor in config.sensors.items():
            below = f"physics/{topic}"
            if sensor.view is None:
                found[topic] = sdk.Out(Imu, f"{below}/imu").named(topic)
                continue
            shoot, colour, distance = shooting(topic)
            found[shoot] = sdk.In(Empty, f"{below}/shoot", qos="event").named(shoot)
            found[colour] = sdk.Out(Image, f"{below}/colour", qos="bulk").named(colour)
            found[distance] = sdk.Out(Image, f"{below}/distance", qos="bulk").named(distance)
        return found

    @classmethod
    def capabilities(cls, config: PhysicsConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it needs."""
        return (sdk.NeedsExtra(sdk.Setting("mujoco"), sdk.Setting("physics")),)

    def configure(self) -> None:
        """Wait for the world."""
        self.engine: PhysicsWorld | None = None
        self.at_end.callback(self.end_engine)
        self.sensors = dict[str, PhysicsSensor]()  # on links that exist
        self.wanted, self.wanted_at = AT_REST, 0.0
        self.touched: frozenset[str] = frozenset()
        self.contacts = 0
        self.estimate = Pose2()  # by the wheels, in `odom`
        self.angles = (0.0, 0.0)
        self.drawing = sdk.TaskStatus(Level.OK, "are drawn when somebody wants them")

    def activate(self) -> None:
        """Report what was changed in the body."""
        self.add_diagnostic("body", self.repairs)
        if any(sensor.view for sensor in self.config.sensors.values()):
            self.add_diagnostic("pictures", lambda now: self.drawing)

    def repairs(self, now: float) -> sdk.TaskStatus:
        """Report what was changed in the body."""
        if self.engine is None:
            return sdk.TaskStatus(Level.WARN, "there is no world yet")
        changed = "; ".join(f"{repair.link}: {repair.what}" for repair in self.engine.repairs)
        return sdk.TaskStatus(Level.OK, changed or "as in the URDF")

    def on_world(self, message: World) -> None:
        """Build the world, with the robot where it is put."""
        if self.engine is not None:
            self.engine.close()
        world, config = world_of(message), self.config
        robot = PhysicsRobot(
            body_of(config.urdf) if config.urdf else outline_body(message.radius, message.height),
            {name: Path(file) for name, file in config.meshes.items()},
            drives=config.drives,
            wheel_distance=config.wheel_distance,
            servos=config.servos,
        )
        self.known = world
        # Other robots are moved, and nothing else moves them.
        others = (replace(one, path=ShapePath(((0.0, one.pose.x, one.pose.y),))) for one in world.robots)
        world = replace(world, shapes=(*world.shapes, *others))
        loose = {shape.name: shape.mass for shape in world.shapes if shape.mass}
        self.sensors = {topic: one for topic, one in config.sensors.items() if one.frame in robot.body.links}
        cameras = {topic: one for topic, sensor in self.sensors.items() if (one := sensor.camera) is not None}
        self.engine = PhysicsWorld(robot, world, loose, cameras, time=self.now)
        for topic in [*cameras][:1]:  # the first picture takes long: not while the robot drives
            self.drawn(self.engine, topic)
        self.pushed = [*loose]
        self.shares, self.aimed_at = dict[str, float](), dict[tuple[str, ...], float]()  # the latter by bus of servos
        self.estimate, self.angles = world.start, self.rolled(self.engine)
        for repair in self.engine.repairs:
            self.info(f"{repair.link}: {repair.what}")

    def on_others(self, message: WorldRobots) -> None:
        """Take where other robots are: they push, and cannot be pushed."""
        if self.engine is not None:
            self.known = self.known.with_robots(message, self.now)

    def on_command(self, message: geometry.Twist) -> None:
        """Let the wheels turn for this velocity."""
        self.wanted, self.wanted_at = Velocity2(message.linear.x, message.angular.z), self.now

    def on_set_points(self, message: JointState) -> None:
        """Let joints move to set points, and wheels at their speeds, with parts of the most effort; 0 lets go."""
        engine = self.engine
        if engine is None:
            return
        within = min(self.now - self.aimed_at.get(message.name, self.now), SLOWEST)
        self.aimed_at[message.name] = self.now
        rows = zip(message.name, message.position, message.velocity, message.effort, strict=True)
        for name, position, velocity, share in rows:
            place = engine.converted.joints.get(name)
            if place is None or place.actuator is None:
                continue
            if share != self.shares.get(name):
                self.shares[name] = share
                engine.limit(name, share * place.effort)
            if name in engine.converted.signs:
                engine.turn(name, velocity)
            elif share > 0.0:
                engine.target(name, position, within)

    def received(self, port: str, message: Any) -> None:
        """Draw what a camera sees."""
        for topic in self.sensors:
            if port == shooting(topic)[0] and self.engine is not None:
                self.shoot(self.engine, topic)

    def shoot(self, engine: PhysicsWorld, topic: str) -> None:
        """Publish colours, and then distances along the optical axis, as a camera without distortion sees them."""
        if (picture := self.drawn(engine, topic)) is None:
            return
        _, colour, distance = shooting(topic)
        header = Header(stamp=to_time(self.stamp), frame_id=optical_frame(self.sensors[topic].frame))
        self.bound[colour](picture_message(header, picture.colours))
        self.bound[distance](depth_message(header, picture.depths))

    def drawn(self, engine: PhysicsWorld, topic: str) -> DepthPicture | None:
        """Return what a camera sees; None if this machine cannot draw, which is reported."""
        try:
            return engine.picture(topic)
        except ImportError as error:
            if self.drawing.level is Level.OK:
                self.warn(str(error))
            self.drawing = sdk.TaskStatus(Level.ERROR, str(error))
            return None

    def tell_motion(self, engine: PhysicsWorld) -> None:
        """Publish what inertial sensors measure."""
        for topic, sensor in self.sensors.items():
            if sensor.view is None and self.bound[topic].is_wanted:
                header = Header(stamp=to_time(self.stamp), frame_id=sensor.frame)
                self.bound[topic](imu_message(header, engine.imu(sensor.frame)))

    def tell_joints(self, engine: PhysicsWorld) -> None:
        """Publish where the joints of servos are, how they move, and which part of the most effort they feel."""
        if not self.config.servos or not self.bound["joints"].is_wanted:
            return
        joints = {name: place for name, place in engine.converted.joints.items() if name in self.config.servos}
        rows = [
            (engine.position(name), engine.velocity(name), engine.effort(name) / (place.effort or 1.0))
            for name, place in joints.items()
        ]
        positions, velocities, efforts = np.array(rows).T
        header = Header(stamp=to_time(self.stamp))
        self.bound["joints"](JointState(header, tuple(joints), positions, velocities, efforts))

    def step(self, dt: float) -> None:
        """Let time pass, and publish where everything is."""
        engine = self.engine
        if engine is None:
            return
        if engine.converted.wheels is not None and self.config.servos.keys().isdisjoint(engine.converted.signs):
            wanted = self.wanted if self.now - self.wanted_at <= SILENCE else AT_REST
            engine.drive(wanted.linear, wanted.angular)
        for robot in self.known.robots_standing(self.now):
            engine.place(robot.name, robot.pose)
        engine.step(dt)
        stamp = to_time(self.stamp)
        self.measured(odometry(Header(stamp=stamp, frame_id=ODOM), *self.measure(engine, dt)))
        self.truth(odometry(Header(stamp=stamp, frame_id=MAP_FRAME), engine.base_pose, engine.base_velocity))
        self.tell_joints(engine)
        self.tell_motion(engine)
        self.tell_contacts(engine)
        if self.pushed and self.moved.is_wanted:
            header = Header(stamp=stamp, frame_id=MAP_FRAME)
            places = ((name, transform_message(engine.shape_pose(name))) for name in self.pushed)
            self.moved(TFMessage(transforms=tuple(geometry.TransformStamped(header, *place) for place in places)))

    def measure(self, engine: PhysicsWorld, dt: float) -> tuple[Pose2, Velocity2]:
        """Return where the wheels believe the base to be in `odom`, and how fast they turn."""
        wheels = engine.converted.wheels
        if wheels is None or dt <= 0:
            return self.estimate, AT_REST
        before, self.angles = self.angles, self.rolled(engine)
        left, right = (now - then for now, then in zip(self.angles, before, strict=True))
        velocity = Velocity2((left + right) / 2 / dt, (right - left) / wheels.distance / dt)
        self.estimate = self.estimate.moved(velocity, dt)
        return self.estimate, velocity

    def rolled(self, engine: PhysicsWorld) -> tuple[float, float]:
        """Return how far the left and the right wheels have rolled [m]."""
        wheels = engine.converted.wheels
        if wheels is None:
            return 0.0, 0.0
        left, right = engine.wheel_angles
        return left * wheels.radius, right * wheels.radius

    def tell_contacts(self, engine: PhysicsWorld) -> None:
        """Publish what the robot begins to touch, but for the ground and itself."""
        touched = engine.touched() - {GROUND}
        for what in sorted(touched - self.touched):
            self.contacts += 1
            self.contact(String(data=what))
        self.touched = touched

    def end_engine(self) -> None:
        """Let go of the engine."""
        if self.engine is not None:
            self.engine.close()
            self.engine = None

    def summary(self) -> dict[str, str]:
        """Report how often it began to touch something."""
        return {"contacts": str(self.contacts)}


def shooting(topic: str) -> tuple[str, str, str]:
    """Return the ports by which a camera asks for pictures, and gets them."""
    return f"{topic} shoot", f"{topic} colour", f"{topic} distance"


def odometry(header: Header, pose: Pose2, velocity: Velocity2) -> Odometry:
    """Return a planar pose and velocity as a message."""
    return Odometry(
        header=header,
        child_frame_id=BASE,
        pose=geometry.PoseWithCovariance(pose=message_of(pose)),
        twist=geometry.TwistWithCovariance(twist=twist_message(velocity)),
    )
