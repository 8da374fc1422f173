"""The section `heads`: cameras that joints point at things."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from rbxcompose.base.config import CONTROLLER, Config, LinkName, Name, Refers
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import kind
from rbxcompose.domains.arms.motion.groups import chain
from rbxcompose.domains.arms.section_models import HeadTracking
from rbxcompose.domains.arms.sections.arms import arms, joint_limits
from rbxcompose.domains.arms.sections.scene import scene
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.servos.sections.controllers import controllers, follow_topic, stream_topic
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, WantedComponent, Wiring

HEAD = "head"
NOT_TURNED = kind("RBX2355")


class HeadModel(Config):
    """A camera, and the controller that turns it."""

    camera: LinkName
    """The link that looks along its x: no optical frame, which looks along z."""
    controller: Annotated[Name, Refers(CONTROLLER)]
    """The controller that leads its joints."""
    frames: list[Name] = []
    """Frames outside of the body in which points may be, beside those of `scene`."""
    tracks: HeadTracking = HeadTracking()
    """What it follows by itself while it has no goal."""


@dataclass(frozen=True, slots=True)
class HeadOfRobot:
    """A head as it is written, and the joints of its controller that turn its camera, from the root on."""

    model: HeadModel
    joints: tuple[str, ...]


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that turns each head."""
    description, found = contents.of(body), contents.of(heads)
    if description is None:
        return
    for name, head in found.items():
        one = head.model
        frames = dict.fromkeys((*one.frames, *contents.of(scene).frames))
        if one.tracks.frame and one.tracks.frame not in description.body.links:
            frames[one.tracks.frame] = None
        config = {
            "name": name,
            "skill": "look_at" if len(found) == 1 else f"look_at_{name}",
            "urdf": description.text,
            "camera": one.camera,
            "joints": {joint: joint_limits(contents, description.body.joints[joint]) for joint in head.joints},
            "controller": one.controller,
            "follow": follow_topic(contents, one.controller),
            "stream": stream_topic(contents, one.controller),
            "sees_scene": bool(contents.of(arms)),
            "tracks": one.tracks,
            "frames": tuple(each for each in frames if each != description.body.frame),
        }
        yield WantedComponent(name, HEAD, config, ("heads", name))


@section(
    "heads", HeadModel, order=38, names=HEAD, runs=True, wires=True, entry="head", repeats=False, components=_components
)
def heads(reading: Reading[HeadModel]) -> dict[str, HeadOfRobot]:
    """Heads by name: a camera, and the joints that point it at things. With one head, its skill is `look_at`.

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
          neck:
            type: joint_trajectory
            joints: [pan_joint]
        heads:
          head: {camera: head, controller: neck}
    """
    description, found = reading.contents.of(body), dict[str, HeadOfRobot]()
    for name, entry in reading.entries().items():
        there = reading.contents.of(controllers).get(entry.controller)
        if description is None or there is None or entry.camera not in description.body.links:
            continue  # it is missing or has a mistake, which is reported
        turning = chain(description.body, description.body.root, entry.camera)
        led = tuple(joint for joint in there.claimed if turning and joint in turning.joints)
        if led and follow_topic(reading.contents, entry.controller):
            found[name] = HeadOfRobot(entry, led)
        else:
            path = ("heads", name, "controller")
            words = f"moves no joint between '{description.body.root}' and '{entry.camera}'"
            message = f"'{entry.controller}' {words if not led else 'follows no trajectories'}"
            reading.report.add(NOT_TURNED.at(reading.value(*path), message))
    return found
