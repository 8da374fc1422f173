"""What simulated bumpers and cliff sensors have in common: they see the world and say which switches are on."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

import numpy as np
from pydantic import Field

from rbxcompose import sdk
from rbxcompose.domains.worlds.sensors import SensorConfig, WorldSensor
from rbxcompose.domains.worlds.world import SimulatedWorld
from rbxcompose.msgs.rbxcompose_msgs import Switches
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header


class SwitchesConfig(SensorConfig):
    """What all switches have."""

    rate: sdk.Frequency = Field(50.0, gt=0, le=1000)
    """How often it says which ones are on."""


C = TypeVar("C", bound=SwitchesConfig)


class SwitchesSim(WorldSensor[C]):
    """Switches of one kind around a robot in a simulated world."""

    @classmethod
    def rate_of(cls, config: C) -> float:
        """Return how often it looks [Hz]."""
        return config.rate

    @classmethod
    def ports(cls, config: C) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the topic of the switches."""
        topic = cls.topic_of(config)
        return super().ports(config) | {"switches": sdk.Out(Switches, topic, rate=config.rate).named("switches")}

    @classmethod
    @abstractmethod
    def topic_of(cls, config: C) -> str:
        """Return where it publishes."""

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
