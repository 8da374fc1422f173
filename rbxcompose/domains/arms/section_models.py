"""What sections say of arms, hands and clouds."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, WithJsonSchema, field_validator

from rbxcompose.base.config import (
    LINK,
    OBJECT,
    Angle,
    AngularSpeed,
    Config,
    Frequency,
    Length,
    LinkName,
    Live,
    Name,
    Refers,
    Time,
)
from rbxcompose.manifest.fields import TopicName

AUTOMATIC, FAST = "automatic", "fast"
"""Ours where numba is installed, then the first of OMPL's below; and ours, which has to be there."""
OMPL = {
    "rrt_connect": "RRTConnect",
    "rrt": "RRT",
    "rrt_star": "RRTstar",
    "informed_rrt_star": "InformedRRTstar",
    "aorrtc": "AORRTC",
    "bit_star": "BITstar",
    "bkpiece": "BKPIECE1",
    "kpiece": "KPIECE1",
    "lbkpiece": "LBKPIECE1",
}
"""OMPL's classes, by the names in manifests. SBL, EST and TRRT are not in its wheels, and PRM cannot be interrupted."""
PLANNERS = (AUTOMATIC, FAST, *OMPL)


def ompl_planner(name: str) -> str:
    """Return the planner of OMPL that searches when our own found nothing, or is not there."""
    return next(iter(OMPL)) if name in (AUTOMATIC, FAST) else name


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


PlannerName = Annotated[str, WithJsonSchema({"type": "string", "enum": list(PLANNERS)})]


class ChainModel(Config):
    """From the link that carries an arm to the link at its end."""

    from_: LinkName = Field(alias="from")
    """The link that carries it."""
    to: Annotated[str, Refers(LINK, is_reported=True)]
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


class HeadTracking(Config):
    """What a head follows by itself while it has no goal, and how."""

    frame: str = ""
    """A frame, such as that of a tag with a name (`tag_box`)."""
    topic: TopicName | None = None
    """A topic with poses, such as `target_pose`. Points on `NAME/target` are followed in any case."""
    mode: Annotated[Literal["position", "speed"], Live()] = "speed"
    """`position`: it goes to where the target is; `speed`: at a speed by how far away that is."""
    gain: Annotated[float, Field(gt=0), Live()] = 5.0
    """Speed in rad/s for each radian that is missing; by positions, the part that it makes up for at once, up to 1."""
    threshold: Annotated[Angle, Live()] = Field(0.0, ge=0)
    """What it does not make up for."""
    speed: Annotated[AngularSpeed, Live()] = Field(1.5, gt=0)
    """Largest speed of a joint, in the mode `speed`."""
    slowest: Annotated[AngularSpeed, Live()] = Field(0.001, ge=0)
    """Smallest one, if it moves."""
    ahead: Annotated[Angle, Live()] = Field(0.5, gt=0)
    """How far ahead of its joints it sends them."""
    delay: Annotated[Time, Live()] = Field(0.1, ge=0, le=1)
    """How late joints are where they should be: the target is expected so far ahead."""
    lost: Annotated[Time, Live()] = Field(0.5, gt=0)
    """Without a target, after which that is lost, and the head slows down."""
    recentre: Annotated[Time, Live()] = Field(2.0, ge=0)
    """After which it looks ahead again; with 0, it does not."""
    search: Annotated[Time, Live()] = Field(0.0, ge=0)
    """How long it looks around before that."""
    calm: Annotated[AngularSpeed, Live()] = Field(0.3, gt=0)
    """How fast it looks around, and back."""
