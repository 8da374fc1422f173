"""Simulated bumpers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Annotated

from pydantic import AfterValidator, Field

from rbxcompose import sdk
from rbxcompose.domains.worlds.sensors import SwitchesConfig, SwitchesSim
from rbxcompose.domains.worlds.world import SimulatedWorld
from rbxcompose.manifest.fields import TopicName

SIDE, FRONT = math.radians(90), math.radians(30)  # where Kobuki's bumpers end, according to its Gazebo plug-in


def _is_sector(ends: tuple[float, float]) -> tuple[float, float]:
    if not 0 < ends[1] - ends[0] <= math.tau:
        raise ValueError("a bumper goes from one angle to a larger one, to the left")
    return ends


Sector = Annotated[tuple[sdk.Angle, sdk.Angle], AfterValidator(_is_sector)]


class BumperSimConfig(SwitchesConfig):
    """Where the bumpers are, and how far they stand out."""

    bumpers: dict[sdk.Name, Sector] = Field(
        {"left": (FRONT, SIDE), "centre": (-FRONT, FRONT), "right": (-SIDE, -FRONT)}, min_length=1
    )
    """The bumpers, each with the angles from which and to which it reaches; 0 is ahead, 90 deg to the left."""
    travel: sdk.Length = Field(0.002, gt=0, le=0.1)
    """How far something may be away from the outline of the robot and presses a bumper."""
    topic: TopicName = "bumper"
    """Where it says which ones are pressed."""


@sdk.component("bumper_sim")
class BumperSim(SwitchesSim[BumperSimConfig]):
    """Bumpers around a round robot, which what is in the robot's `world` presses.

    Example:
        bumpers: {type: bumper_sim, bumpers: {left: [0 deg, 90 deg], right: [-90 deg, 0 deg]}}
    """

    def angles(self) -> Mapping[str, float]:
        """Return the middle of each bumper [rad]."""
        return {name: (begin + end) / 2 for name, (begin, end) in self.config.bumpers.items()}

    def are_on(self, world: SimulatedWorld, pose: sdk.Pose2) -> Iterable[bool]:
        """Return which bumpers are pressed."""
        touched = world.touching(pose, self.config.travel, self.now)
        for begin, end in self.config.bumpers.values():
            yield bool(((touched - begin) % math.tau <= end - begin).any())
