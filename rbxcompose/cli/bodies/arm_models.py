"""Goals of arms on the command line, with the words that missions have for them, as goals of actions."""

from __future__ import annotations

from typing import Any

from rbxcompose.body.attachment import FramePose
from rbxcompose.config import Angle, Config, Length, Ratio, Speed
from rbxcompose.sections.joints import JointPosition


class TracePointModel(FramePose):
    """A point that the tip goes through."""

    via: bool = False
    """Whether it is in the middle of an arc."""


class TraceModel(Config):
    """A way of the tip."""

    points: list[TracePointModel]
    """From where the tip is."""
    frame: str = ""
    """A link; empty is the root."""
    relative: bool = False
    """Whether points are shifts and turns."""
    keep_orientation: bool = False
    """Whether the tip stays turned as it is."""
    any_orientation: bool = False
    """Whether only positions count."""
    speed: Speed = 0.0
    """Of the tip."""
    acceleration: Ratio = 0.0
    """Share of the greatest ones."""
    blend: Length = 0.0
    """From there on before a corner, the tip cuts it."""
    least: Ratio = 0.0
    """Share of the way that must be possible."""

    def message(self) -> dict[str, Any]:
        """Return it as a goal of `TraceArm`."""
        return self.model_dump()


class KeptJointModel(Config):
    """Where a joint may be."""

    name: str
    """The joint."""
    lower: JointPosition
    """Least position."""
    upper: JointPosition
    """Greatest position."""


class SightModel(Config):
    """What a sensor sees."""

    sensor: str
    """Its link."""
    along: str = ""
    """The axis of its frame along which it looks."""
    target: str = ""
    """The link in whose frame the target is; empty is the root."""
    x: Length = 0.0
    """Of the target."""
    y: Length = 0.0
    """Of the target."""
    z: Length = 0.0
    """Of the target."""
    radius: Length = 0.0
    """Of the disc that is to be seen."""
    angle: Angle = 0.0
    """By which it may be off the axis."""
    through: list[str] = []
    """Links and objects that may be in between."""


class KeepModel(Config):
    """What is kept on the way."""

    roll: Angle = 0.0
    """By which the tip may be turned about x."""
    pitch: Angle = 0.0
    """By which the tip may be turned about y."""
    yaw: Angle = 0.0
    """By which the tip may be turned about z."""
    frame: str = ""
    """A link; empty is the root."""
    x: list[Length] = []
    """From and to."""
    y: list[Length] = []
    """From and to."""
    z: list[Length] = []
    """From and to."""
    joints: list[KeptJointModel] = []
    """Ranges of joints."""
    sight: SightModel | None = None
    """What a sensor sees."""

    def message(self) -> dict[str, Any]:
        """Return it as `PathConstraints`."""
        joints = [{"name": one.name, "lower": one.lower.value, "upper": one.upper.value} for one in self.joints]
        return {**self.model_dump(exclude_none=True, exclude={"joints"}), "joints": joints}
