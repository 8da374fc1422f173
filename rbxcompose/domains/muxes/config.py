"""The configuration of a mux."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from rbxcompose.base.config import Acceleration, AngularAcceleration, Config, Frequency, Live, Name, Time
from rbxcompose.manifest.fields import TopicName

MuxMode = Literal["priority", "select", "latest"]
MuxProfile = Literal["default", "topic_tools", "twist_mux", "yocs"]

MODE_OF: dict[MuxProfile, MuxMode] = {
    "default": "priority",
    "topic_tools": "select",
    "twist_mux": "priority",
    "yocs": "priority",
}
"""The mode that a profile has if none is given; only the default profile has others, too."""

HIGHEST = 255
"""The highest priority of twist_mux."""
OWN_NAMES = frozenset({"output", "announced", "active", "selected", "select", "add", "delete", "list"})
"""Names that a mux needs itself, below its topic or among its ports; so are those that begin with `lock_`."""
VELOCITIES = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")
"""Types whose zero is rest by their definition. A zero position, pose or flag is a command like any other."""
TIMELESS: frozenset[MuxProfile] = frozenset({"twist_mux", "yocs"})
"""Profiles in which a timeout may be 0."""


def is_own(name: str) -> bool:
    """Return whether a mux needs a name itself, so that no input or lock can have it."""
    return name in OWN_NAMES or name.startswith("lock_")


class HoldFirst(Config):
    """The last command stays in force for a while, then a stop follows."""

    hold: Time = Field(gt=0)
    """How long until the stop. Nothing is repeated, so a receiver that brakes by itself may do so earlier."""


def _form(value: object) -> str:
    return "word" if isinstance(value, str) else "hold"


MuxEnding = Annotated[
    Annotated[Literal["none", "stop"], Tag("word")] | Annotated[HoldFirst, Tag("hold")], Discriminator(_form)
]


class HandoverLimits(Config):
    """How fast the output may grow from what one source commanded to what the next one commands."""

    linear: Annotated[Acceleration | None, Live()] = Field(None, gt=0)
    """For each axis; without it, it is not limited."""
    angular: Annotated[AngularAcceleration | None, Live()] = Field(None, gt=0)
    """For each axis; without it, it is not limited."""


ANNOUNCED: Mapping[MuxProfile, str] = {"topic_tools": "selected"}
ACTIVE = "active"  # the topic below the mux on which it announces who holds the output
NOBODY: Mapping[MuxProfile, str] = {"yocs": "idle"}


class MuxInputConfig(Config):
    """An input."""

    topic: TopicName | None = None
    """Its topic, if that is not `<output>/<name>`."""
    priority: int = 0
    """The input with the highest priority wins, where priorities count."""
    timeout: Time | None = Field(None, ge=0)
    """The input counts as silent after this long without a message."""
    max_rate: Frequency | None = Field(None, gt=0)
    """Most messages from one publisher in another process; the rest is dropped and reported. Default: 1000 Hz."""
    zero_releases: bool = False
    """Whether its zero lets go of the output at once."""


class AddedInput(MuxInputConfig):
    """An input that is added while the robot runs."""

    name: Name | None = None
    """Its name, if that is not its topic."""


class MuxLockConfig(Config):
    """A lock."""

    topic: str | None = None
    """The topic of a flag; without it, it is a heartbeat at `<output>/<name>`."""
    priority: int | None = None
    """Inputs with a lower priority are locked; all, where priorities do not count."""
    timeout: Time | None = Field(None, ge=0)
    """It engages after this long without a message."""


TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"


class MuxConfig(Config):
    """The output, its inputs and locks, and who gets through."""

    output: str
    """Topic to which the messages of who holds it are forwarded."""
    message: str = "geometry_msgs/msg/Twist"
    """ROS name of the message type."""
    mode: MuxMode = "priority"
    """Who gets through: the live input with the highest priority, the selected one, or who sent last."""
    profile: MuxProfile = "default"
    """Whose rules are followed: ours, or those of a program of ROS."""
    inputs: dict[str, MuxInputConfig]
    """Sources by name; each has the topic `<output>/<name>`."""
    locks: dict[str, MuxLockConfig] = {}
    """Locks by name. A silent heartbeat, or a flag that is true, locks all inputs of a lower priority."""
    initial: str | None = None
    """The input that is selected first, `__none` for none; by default the first one."""
    lazy: bool = False
    """Whether only the selected input is subscribed to."""
    on_idle: MuxEnding | None = None
    """What follows the last command if no input is live any more; by default a stop, where zero is rest."""
    on_lock: MuxEnding | None = None
    """What follows the last command if its input was locked."""
    handover: HandoverLimits | None = None
    """How fast the output may grow after another input took over."""
    zero_stops: bool | None = None
    """Whether a message of zeros commands rest; by default for velocities."""

    @property
    def has_priorities(self) -> bool:
        """Return whether priorities count."""
        return self.mode == "priority"

    @property
    def quality(self) -> str:
        """Return the class of its messages: a trajectory does not give way to the next one, as a velocity does."""
        return "state" if self.message == TRAJECTORY else "command"

    @property
    def has_rest(self) -> bool:
        """Return whether a message of zeros commands rest."""
        return self.message in VELOCITIES if self.zero_stops is None else self.zero_stops

    @property
    def announced(self) -> str:
        """Return the word below the output at which it announces who holds it."""
        return ANNOUNCED.get(self.profile, ACTIVE)

    def topic_of(self, name: str) -> str:
        """Return the topic of an input or a lock as it is written."""
        config = self.inputs.get(name) or self.locks.get(name)
        return (config.topic if config else None) or f"{self.output}/{name}"


def handover_limits(limits: HandoverLimits | None) -> tuple[float, float]:
    """Return the limits of a hand-over [m/s^2, rad/s^2]; infinite where there is none."""
    linear, angular = (limits.linear, limits.angular) if limits else (None, None)
    return math.inf if linear is None else linear, math.inf if angular is None else angular
