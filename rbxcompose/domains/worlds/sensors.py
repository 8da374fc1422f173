"""What all simulated sensors have in common: they know the world, and where they really are in it."""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.domains.worlds.world import SimulatedWorld, world_of
from rbxcompose.msgs.geometry_msgs import Transform
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import pose_in, pose_of, transform_of
from rbxcompose.msgs.rbxcompose_msgs import Switches, World, WorldRobots
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.bound import Sender
from rbxcompose.sdk.ports import BULK

BASE = "base_footprint"
OTHERS = "world/others"
TRUTH_REMEDY = (
    "it needs a 'world', and 'simulator: physics' or the base 'diff_drive_sim': these know where the robot is in truth"
)


class SensorConfig(sdk.Config):
    """Where a sensor is."""

    frame: str = BASE
    """Its frame: x is ahead."""
    latency: sdk.Time = Field(0.0, ge=0, le=10)
    """From what it sees until it publishes that, with the stamp of when it saw it."""


C = TypeVar("C", bound=SensorConfig)
M = TypeVar("M")


class WorldSensor(sdk.Component[C]):
    """A sensor at a frame of a robot in a simulated world; where that robot is, its base tells at `ground_truth`."""

    process = "world"
    simulated = True
    world = sdk.In(World, "world", qos="latched", limits=BULK)
    truth = sdk.In(Odometry, "ground_truth", remedy=TRUTH_REMEDY)
    moved = sdk.In(TFMessage, "world/moved", is_open=True, may_be_silent=True)
    others = sdk.In(WorldRobots, OTHERS, is_open=True, may_be_silent=True)

    @classmethod
    def rate_of(cls, config: Any) -> float:
        """Return how often it measures [Hz]."""
        return float(config.rate)

    @classmethod
    def ports(cls, config: C) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with where it is mounted."""
        return super().ports(config) | {"mounting": sdk.Looks(source=config.frame, target=BASE).named("mounting")}

    def configure(self) -> None:
        """See nothing yet."""
        self.seen: SimulatedWorld | None = None
        self.late = deque[tuple[float, Sender[Any], Any]]()  # messages, and when they are published [s]

    def on_world(self, message: World) -> None:
        """See this world from now on."""
        self.seen = world_of(message)

    def on_moved(self, message: TFMessage) -> None:
        """See things where the robot has pushed them."""
        if self.seen is not None:
            self.seen = self.seen.with_moved({one.child_frame_id: placed(one.transform) for one in message.transforms})

    def on_others(self, message: WorldRobots) -> None:
        """See other robots where they are."""
        if self.seen is not None:
            self.seen = self.seen.with_robots(message, self.now)

    def tell(self, sender: Sender[M], message: M) -> None:
        """Publish a message, now or after the latency."""
        if (latency := self.config.latency) > 0:
            self.late.append((self.now + latency, sender, message))
            self.context.wake_at(self.now + latency)
        else:
            sender(message)

    def wake(self) -> None:
        """Publish what is due."""
        while self.late and self.late[0][0] <= self.now + 1e-9:
            _, sender, message = self.late.popleft()
            sender(message)

    def place(self) -> tuple[Pose2, float] | None:
        """Return its pose in `map` and its height above the ground [m]; None if it is not known yet."""
        if (base := self.truth.value) is None or (mounted := self.bound["mounting"].now()) is None:
            return None
        return pose_in(base.pose.pose).compose(mounted), self.bound["mounting"].transform().translation[2]

    def pose(self) -> Transform3 | None:
        """Return the pose of its frame in `map`; None if it is not known yet."""
        if (base := self.truth.value) is None or self.bound["mounting"].now() is None:
            return None
        mounted: Transform3 = self.bound["mounting"].transform()
        return pose_of(base.pose.pose).compose(mounted)


def placed(transform: Transform) -> tuple[Pose2, float]:
    """Return the planar part of a transform, and its height [m]."""
    at = transform_of(transform)
    return at.to_pose2(), at.translation[2]


class SwitchesConfig(SensorConfig):
    """What all switches have."""

    rate: sdk.Frequency = Field(50.0, gt=0, le=1000)
    """How often it says which ones are on."""


S = TypeVar("S", bound=SwitchesConfig)


class SwitchesSim(WorldSensor[S]):
    """Switches of one kind around a robot in a simulated world."""

    @classmethod
    def ports(cls, config: Any) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the topic of the switches."""
        return super().ports(config) | {"switches": sdk.Out(Switches, config.topic, rate=config.rate).named("switches")}

    @abstractmethod
    def angles(self) -> Mapping[str, float]:
        """Return in which direction each of the switches is [rad]."""

    @abstractmethod
    def are_on(self, world: SimulatedWorld, pose: sdk.Pose2) -> Iterable[bool]:
        """Return which of them are on while the robot is at a pose in `map`."""

    def step(self, dt: float) -> None:
        """Say which switches are on, if it is known where the robot is."""
        if self.seen is not None and (place := self.place()) is not None:
            on = self.are_on(self.seen, place[0])
            self.tell(self.bound["switches"], switches(self.stamp, self.config.frame, self.angles(), on))


def switches(stamp: int, frame: str, angles: Mapping[str, float], on: Iterable[bool]) -> Switches:
    """Return a message about switches at angles [rad] around the origin of a frame, at a stamp [ns]."""
    header = Header(stamp=to_time(stamp), frame_id=frame)
    return Switches(header, tuple(angles), np.array([*angles.values()], float), tuple(map(bool, on)))
