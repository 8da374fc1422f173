"""The world of a simulated robot, for all that is in it or sees it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import Pose2, Velocity2
from rbxcompose.base.levels import Level
from rbxcompose.domains.worlds.grid_map import read_map
from rbxcompose.domains.worlds.sensors import OTHERS
from rbxcompose.domains.worlds.shapes import WorldCylinder, WorldShape
from rbxcompose.domains.worlds.world import FORESEEN, MAP_FRAME, SimulatedWorld, no_walls, world_message
from rbxcompose.domains.worlds.world_file import WorldHoleModel, WorldLightModel, WorldObjectModel
from rbxcompose.msgs import rbxcompose_msgs
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import pose_in
from rbxcompose.msgs.rbxcompose_msgs import WorldRobots
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.capabilities import Outline, SharesWorld

REMINDED = 0.5  # [s] after which a robot that stands says so again
SILENT = 2.0  # [s] after which a robot that says nothing is silent
PLACE, ROBOTS = "world/place", "world/robots"
Motion = tuple[float, float, float, float, float]
"""Of a robot: x, y [m] and heading [rad] in `map`, speed [m/s], turn rate [rad/s]."""


class WorldConfig(sdk.Config):
    """What is in the world, and the robot's place and size."""

    name: str
    """Its name."""
    map: str = ""
    """The YAML file of its map; empty if it has no walls."""
    objects: dict[str, WorldObjectModel] = {}
    """What stands or moves there, by name."""
    holes: dict[str, WorldHoleModel] = {}
    """Where the ground is missing, by name."""
    lights: dict[str, WorldLightModel] = {}
    """Lamps, by name."""
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the robot is put: x, y [m] and heading [rad]."""
    radius: float = 0.2
    """Radius of the robot seen from above [m]."""
    height: float = 0.5
    """Height of the robot [m]."""
    robot: str = ""
    """The robot's name in its system."""
    robots: tuple[str, ...] = ()
    """The robots of the system in this world. The first one hears all others, and tells all where each is."""
    others: dict[str, Outline] = {}
    """Of the others: where they begin, x, y [m] and heading [rad], and their radius and height [m]."""
    rate: Annotated[sdk.Frequency, Field(gt=0, le=100)] = 20.0
    """How often a robot that moves says where it is."""


@sdk.component("world")
class WorldSim(sdk.Component[WorldConfig]):
    """Holds the world of a simulated robot: bases touch it, sensors see it.

    Example:
        house: {type: world, name: house}
    """

    made_by = "The section `world` runs it."
    process = "world"
    simulated = True
    world = sdk.Out(rbxcompose_msgs.World, "world", qos="latched")

    @classmethod
    def rate_of(cls, config: WorldConfig) -> float:
        """Return how often it says where the robot is, if there are others [Hz]."""
        return config.rate if len(config.robots) > 1 else 0.0

    @classmethod
    def ports(cls, config: WorldConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with those between robots."""
        ports = super().ports(config)
        if len(config.robots) < 2:
            return ports
        first, *rest = config.robots
        ports["truth"] = sdk.In(Odometry, "ground_truth", is_open=True).named("truth")
        ports["told"] = sdk.Out(WorldRobots, OTHERS).named("told")
        if config.robot == first:
            ports["robots"] = sdk.Out(WorldRobots, ROBOTS).named("robots")
            return ports | {
                heard(name): sdk.In(WorldRobots, f"/{name}/{PLACE}", may_be_silent=True).named(heard(name))
                for name in rest
            }
        ports["own"] = sdk.Out(WorldRobots, PLACE).named("own")
        ports["all"] = sdk.In(WorldRobots, f"/{first}/{ROBOTS}", may_be_silent=True).named("all")
        return ports

    @classmethod
    def capabilities(cls, config: WorldConfig) -> tuple[sdk.Capability, ...]:
        """Declare where the robot is put, if others of its system are there."""
        if not config.robots:
            return ()
        outline = (*config.start, config.radius, config.height)
        return (SharesWorld(sdk.Setting(outline), sdk.Setting(config.others, "others")),)

    def configure(self) -> None:
        """Read the map."""
        config = self.config
        self.sent: tuple[tuple[str, ...], tuple[Motion, ...], tuple[bool, ...]] | None = None
        self.sent_at = -math.inf
        self.silent: tuple[str, ...] = ()
        self.known: Sequence[str] = config.robots  # by the first one
        self.whole = SimulatedWorld(
            config.name,
            read_map(Path(config.map)) if config.map else no_walls(),
            tuple(model.placed(name) for name, model in config.objects.items()),
            Pose2(*config.start),
            config.radius,
            config.height,
            tuple(model.colour for model in config.objects.values()),
            tuple(model.placed(name) for name, model in config.holes.items()),
            tuple(model.placed(name) for name, model in config.lights.items()),
            tuple(
                WorldShape(name, WorldCylinder(radius, height), Pose2(*start))
                for name, (*start, radius, height) in config.others.items()
            ),
        )

    def activate(self) -> None:
        """Publish it once; who comes late receives it, too."""
        header = Header(stamp=to_time(self.stamp), frame_id="map")
        self.world(world_message(self.whole, header, self.now))
        if len(self.config.robots) > 1:
            self.add_diagnostic("other robots", self.hearing)

    def hearing(self, now: float) -> sdk.TaskStatus:
        """Report which robots are silent, and whether the first one knows others than this robot does."""
        first = self.config.robots[0]
        if {*self.known} != {*self.config.robots}:
            words = f"the world of {first} has {', '.join(self.known)}: all need 'down' and 'up'"
            return sdk.TaskStatus(Level.ERROR, words)
        deaf = self.config.robot != first and self.bound["all"].age > SILENT
        silent = (first,) if deaf else self.silent
        if not silent:
            return sdk.TaskStatus(Level.OK, "all are heard")
        stands = "stands where it was" if len(silent) == 1 else "stand where they were"
        return sdk.TaskStatus(Level.WARN, f"{', '.join(silent)} silent: {stands}")

    def on_all(self, message: WorldRobots) -> None:
        """Tell the robot's base and sensors where others are."""
        own, self.known = self.config.robot, message.names
        self.silent = tuple(name for name, is_silent in zip(message.names, message.silent, strict=True) if is_silent)
        self.silent = tuple(name for name in self.silent if name != own)
        self.bound["told"](message)

    def step(self, dt: float) -> None:
        """Say where the robot is; the first one says where all are."""
        config = self.config
        if config.robot != config.robots[0]:
            self.tell("own", (config.robot,), (self.motion(),), (False,))
            return
        rest = config.robots[1:]
        silent = (False, *(self.bound[heard(name)].age > SILENT for name in rest))
        self.tell("robots", config.robots, (self.motion(), *map(self.motion_of, rest)), silent)

    def tell(self, port: str, names: tuple[str, ...], motions: tuple[Motion, ...], silent: tuple[bool, ...]) -> None:
        """Publish where robots are, if that has changed or was said long ago."""
        sent = names, motions, silent
        if sent == self.sent and self.now - self.sent_at < REMINDED:
            return
        self.sent, self.sent_at = sent, self.now
        header = Header(stamp=to_time(self.stamp), frame_id=MAP_FRAME)
        x, y, heading, speed, turn_rate = np.array(motions).T
        message = WorldRobots(header, names, x, y, heading, speed, turn_rate, silent)
        self.bound[port](message)
        if port == "robots":
            self.on_all(message)

    def motion(self) -> Motion:
        """Return how the robot moves."""
        truth = self.bound["truth"].value
        if truth is None:
            return (*self.config.start, 0.0, 0.0)
        twist = truth.twist.twist
        return advanced(pose_in(truth.pose.pose), twist.linear.x, twist.angular.z, self.bound["truth"].age)

    def motion_of(self, name: str) -> Motion:
        """Return how another robot moves by now; a silent one stands where it was."""
        message, age = self.bound[heard(name)].value, self.bound[heard(name)].age
        if message is None:
            x, y, heading, *_ = self.config.others[name]
            return x, y, heading, 0.0, 0.0
        numbers = message.xs, message.ys, message.headings, message.speeds, message.turn_rates
        x, y, heading, speed, turn_rate = (float(row[0]) for row in numbers)
        if age > SILENT:
            return x, y, heading, 0.0, 0.0
        return advanced(Pose2(x, y, heading), speed, turn_rate, age)


def advanced(pose: Pose2, speed: float, turn_rate: float, age: float) -> Motion:
    """Return how a robot moves that was at a pose `age` [s] ago."""
    now = pose.moved(Velocity2(speed, turn_rate), min(age, FORESEEN))
    return now.x, now.y, now.heading, speed, turn_rate


def heard(name: str) -> str:
    """Return the name of the port by which another robot is heard."""
    return f"heard_{name}"
