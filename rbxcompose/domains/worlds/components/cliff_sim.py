"""Simulated cliff sensors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.domains.worlds.sensors import SwitchesConfig, SwitchesSim
from rbxcompose.domains.worlds.world import SimulatedWorld
from rbxcompose.manifest.fields import TopicName


class CliffSimConfig(SwitchesConfig):
    """Where the sensors look down."""

    sensors: dict[sdk.Name, tuple[sdk.Length, sdk.Length]] = Field(
        {"left": (0.087, 0.136), "centre": (0.156, 0.0), "right": (0.087, -0.136)}, min_length=1
    )
    """The sensors, each with x and y of the frame; by default those of kobuki_description."""
    topic: TopicName = "cliff"
    """Where it says which ones see no floor."""


@sdk.component("cliff_sim")
class CliffSim(SwitchesSim[CliffSimConfig]):
    """Sensors that look down and see where the floor ends: at the `holes` of the robot's `world`.

    Example:
        cliffs: {type: cliff_sim, sensors: {left: [12 cm, 10 cm], right: [12 cm, -10 cm]}}
    """

    @classmethod
    def capabilities(cls, config: CliffSimConfig) -> tuple[sdk.Capability, ...]:
        """Declare where it looks."""
        return (sdk.SeesEdges(sdk.Setting(config.sensors, "sensors")),)

    def angles(self) -> Mapping[str, float]:
        """Return in which direction each sensor is [rad]."""
        return {name: math.atan2(y, x) for name, (x, y) in self.config.sensors.items()}

    def are_on(self, world: SimulatedWorld, pose: sdk.Pose2) -> Iterable[bool]:
        """Return which sensors see no floor."""
        return map(bool, world.over_holes(pose, [*self.config.sensors.values()]))
