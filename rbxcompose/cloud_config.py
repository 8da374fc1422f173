"""What is known of clouds of points: which of their points count, and how long."""

from __future__ import annotations

import math

from pydantic import Field, ValidationInfo, field_validator

from rbxcompose.config import Config, Frequency, Length, Name, Time
from rbxcompose.manifest.fields import TopicName


class CloudModel(Config):
    """Clouds of points of a sensor, which arms plan around."""

    topic: TopicName
    """Their topic, of the type `sensor_msgs/PointCloud2`."""
    range: Length = Field(1.5, gt=0, le=20)
    """How far from the sensor points count."""
    nearest: Length = Field(0.0, ge=0)
    """Nearer points do not count."""
    cell: Length = Field(0.02, ge=0.005, le=0.5)
    """Side of the cells of space that are taken as occupied."""
    least: int = Field(1, ge=1)
    """How many points of one cloud a cell must have: more leave out noise."""
    padding: Length = Field(0.03, ge=0, le=0.5)
    """Points nearer to the robot or to things of the scene are taken for these."""
    forget: Time = Field(5.0, gt=0)
    """How long a cell stays in which clouds show nothing any more."""
    rate: Frequency = Field(2.0, gt=0, le=30)
    """How many clouds a second are used."""
    frame: Name | None = None
    """A frame such as `odom`, in which cells stay where they are while the robot drives; without it the body's root."""

    @field_validator("nearest")
    @classmethod
    def _leaves_points(cls, nearest: float, info: ValidationInfo) -> float:
        if nearest >= info.data.get("range", math.inf):
            raise ValueError("no point is left: it must be less than 'range'")
        return nearest
