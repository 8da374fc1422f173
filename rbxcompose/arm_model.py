"""Parts of an entry of `arms` in a manifest."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, WithJsonSchema

from rbxcompose.config import Angle, Config, Length, LinkName, Name, Time
from rbxcompose.motion.planner_types import AUTOMATIC, PLANNERS

PlannerName = Annotated[str, WithJsonSchema({"type": "string", "enum": list(PLANNERS)})]


class ChainModel(Config):
    """From the link that carries an arm to the link at its end."""

    from_: LinkName = Field(alias="from")
    """The link that carries it."""
    to: LinkName
    """The link at its end, whose frame its goals are for."""


class PlannerModel(Config):
    """How motions are planned."""

    type: PlannerName = AUTOMATIC
    """One of OMPL's, or `fast`: ours, which needs the extra `fast`, then `rrt_connect` where that finds nothing.
    `automatic` is `fast` where that extra is installed, else `rrt_connect`."""
    time: Time = Field(5.0, gt=0, le=60)
    """How long it may search."""
    attempts: int = Field(5, ge=1, le=100)
    """How many paths it may find that collide when they are examined finely, before it gives up."""
    seed: int = Field(1, ge=0)
    """The same seed gives the same path."""
    simplify: bool = True
    """Whether a path that was found is shortened."""
    processes: int = Field(1, ge=1, le=8)
    """How many processes plan to the next ways to an object, or to where it is put, while the first one is not found;
    each beside the arm's own takes 170 MB."""


class SolverModel(Config):
    """How positions of joints are searched that bring the tip to a pose."""

    restarts: int = Field(60, ge=0, le=10_000)
    """How many random positions the search begins from, after the present ones."""
    time: Time = Field(5.0, gt=0, le=60)
    """How long it may take."""
    tolerance: Length = Field(0.001, gt=0)
    """How far the tip may be off, if a goal does not say."""
    angle_tolerance: Angle = Field(math.radians(0.5), gt=0)
    """How far it may be turned, if a goal does not say."""
    prefer: Name | None = None
    """The pose of the arm that its joints should be near to where several positions do, if a goal does not name one."""
