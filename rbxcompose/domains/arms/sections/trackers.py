"""The section `trackers`: arms that follow a point."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated

from pydantic import Field

from rbxcompose.base.config import ARM, Config, Length, LinkName, Name, Refers
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import kind
from rbxcompose.domains.arms.motion.groups import ArmGroup, way_up
from rbxcompose.domains.arms.sections.arms import arms
from rbxcompose.domains.arms.sections.heads import HEAD
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.servos.sections.controllers import stream_topic
from rbxcompose.manifest.fields import TopicName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, WantedComponent, Wiring

TRACKER = "tracker"
NO_REST = kind("RBX2356")


class TrackerModel(Config):
    """An arm, and the topic of the point that it follows."""

    arm: Annotated[Name, Refers(ARM)]
    """The arm."""
    frame: LinkName
    """The frame of the point, such as that of a camera."""
    target: TopicName = "target"
    """The topic with the point, a `PointStamped`."""
    head: Annotated[Name, Refers(HEAD)] | None = None
    """The head that looks at the point meanwhile."""
    rest: Name | None = None
    """The pose to which the arm goes when the point is too far away."""
    length: Length | None = Field(None, gt=0)
    """How far the arm reaches from its shoulder; without it, as far as its links are long."""
    share: float = Field(0.9, gt=0, le=1)
    """How much of that it uses."""
    moved: Length = Field(0.01, ge=0)
    """A point that moved by less is where it was."""
    close: Length = Field(0.025, gt=0)
    """The tip is there when it is nearer than this."""
    farthest: Length = Field(1.2, gt=0)
    """Beyond this, from the shoulder, the arm rests."""


@dataclass(frozen=True, slots=True)
class TrackerOfRobot:
    """A tracker as it is written, and where its arm begins [m] in the frame of its base, and how long that is [m]."""

    model: TrackerModel
    shoulder: tuple[float, float, float]
    length: float


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that follows each point."""
    for name, tracker in contents.of(trackers).items():
        arm, model = contents.of(arms)[tracker.model.arm], tracker.model
        config = {
            "name": name,
            "arm": model.arm,
            "controller": arm.model.controller,
            "base": arm.group.base,
            "tip": arm.group.tip,
            "shoulder": tracker.shoulder,
            "target": model.target,
            "frame": model.frame,
            "rest": model.rest or "",
            "head": model.head or "",
            "length": model.length or tracker.length,
            **model.model_dump(include={"share", "moved", "close", "farthest"}),
        }
        yield WantedComponent(name, "arm_tracker", config, ("trackers", name))


@section(
    "trackers", TrackerModel, order=39, names=TRACKER, runs=True, wires=True, entry="tracker", components=_components
)
def trackers(reading: Reading[TrackerModel]) -> dict[str, TrackerOfRobot]:
    """Arms that follow a point from a topic, by name. `follow_NAME` is a skill of missions.

    Example:
        body:
          urdf: robot.urdf
        buses:
          servos:
            type: dynamixel
        actuators:
          pan_servo: {bus: servos, model: AX-12, id: 1}
        joints:
          pan_joint: {actuator: pan_servo}
        controllers:
          look:
            type: joint_trajectory
            joints: [pan_joint]
        arms:
          neck:
            joints: [pan_joint]
            controller: look
            poses:
              ahead: {pan_joint: 0 deg}
        trackers:
          chase: {arm: neck, frame: base_link, rest: ahead}
    """
    description, found = reading.contents.of(body), dict[str, TrackerOfRobot]()
    for name, entry in reading.entries().items():
        arm = reading.contents.of(arms).get(entry.arm)
        if description is None or arm is None:
            continue  # it is missing or has a mistake, which is reported
        poses = arm.model.poses
        if entry.rest is not None and entry.rest not in poses:
            message = f"the arm '{entry.arm}' has no pose '{entry.rest}'"
            span = reading.value("trackers", name, "rest")
            reading.report.add(NO_REST.misspelt(span, message, entry.rest, list(poses), "its poses"))
        elif not stream_topic(reading.contents, arm.model.controller):
            span = reading.value("trackers", name, "arm")
            reading.report.add(NO_REST.at(span, f"'{arm.model.controller}' takes no stream of trajectories"))
        else:
            found[name] = TrackerOfRobot(entry, *_reach(description.body, arm.group))
    return found


def _reach(known: Body, group: ArmGroup) -> tuple[tuple[float, float, float], float]:
    """Return where the first joint of an arm is in the frame of its base, and how long its links are from there [m]."""
    poses = known.poses({})
    places = [poses[joint.child].translation for joint in way_up(known, group)]
    length = sum(math.dist(place, other) for place, other in pairwise(places))
    return poses[group.base].inverse().apply(places[-1]), length
