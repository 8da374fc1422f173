"""What an arm with a gripper knows of picking and placing."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rbxcompose.config import Angle, Config, Length, LinkName, Name
from rbxcompose.references import OBJECT, Refers


class GraspModel(Config):
    """One way to take hold of an object: the frame between the fingers in that of the object, x ahead, y across."""

    x: Length = 0.0
    """Forward."""
    y: Length = 0.0
    """To the left."""
    z: Length = 0.0
    """Up."""
    roll: Angle = 0.0
    """Turn about x."""
    pitch: Angle = 0.0
    """Turn about y; 90 deg comes from above."""
    yaw: Angle = 0.0
    """Turn about z."""
    width: Length = Field(gt=0)
    """Distance between the fingers when they hold it."""
    quality: float = Field(1.0, gt=0)
    """Better ones are tried first."""


class SpotModel(Config):
    """Where an object may be put."""

    x: Length = 0.0
    """Forward."""
    y: Length = 0.0
    """To the left."""
    z: Length = 0.0
    """Up."""
    frame: LinkName | None = None
    """The link in whose frame the middle of the object is there; without it, the root of the body."""
    on: Annotated[Name, Refers(OBJECT)] | None = None
    """The object upon which it is put: x, y and z are from the middle of its upper face."""
    tolerance: Length = Field(0.0, ge=0)
    """By how much x and y may be missed if the very point is out of reach."""


class HandConfig(Config):
    """The gripper of an arm; lengths in [m]."""

    controller: str
    """Its controller."""
    command: str
    """The action of the controller."""
    opening: tuple[float, float] | None = None
    """Its least and greatest opening; unknown without it."""
    grasp: str
    """The frame between its fingers, which does not move relative to the tip of the arm."""
    squeeze: float = 0.0
    """By how much it is asked to close farther than an object is wide, unless a goal says otherwise."""
    grasps: dict[str, list[GraspModel]] = {}
    """Grasps by the name of the object; those of other objects follow from their shapes."""
    spots: dict[str, SpotModel] = {}
    """Where objects may be put, by name."""
    pictures: str = ""
    """The folder for pictures of failures; empty if there are none."""
