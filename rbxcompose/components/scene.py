"""Tells arms what is around the robot, and what they hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from pydantic import Field

from rbxcompose.body.model import Geometry
from rbxcompose.body.urdf import read_body
from rbxcompose.body.xml_reader import XmlElement, read_urdf
from rbxcompose.geometry import Transform3
from rbxcompose.motion.scene import PlacedObject, PlanningScene, SceneError
from rbxcompose.msgs.geometry_msgs import Point, Pose, Quaternion
from rbxcompose.msgs.rbxcompose_msgs import SceneObject, SceneObjects
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.scene_requests import (
    AddToScene,
    AttachInScene,
    DetachInScene,
    ListScene,
    RemoveFromScene,
    SceneEntry,
)
from rbxcompose.sdk import Component, Config, In, Out, Refused, answers, component


class ObjectConfig(Config):
    """A thing in the frame of a link; lengths in [m]."""

    shape: str
    """`box`, `cylinder` or `sphere`."""
    size: tuple[float, ...]
    """Of a box its three lengths, of a cylinder radius and length, of a sphere its radius."""
    link: str
    """The link that it moves with."""
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where its middle is."""
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    """How it is turned: a quaternion x, y, z, w."""
    touches: tuple[str, ...] = ()
    """Links that it may touch."""


class SceneConfig(Config):
    """The body, and the things that are there from the start."""

    urdf: str
    """Text of the URDF of the body."""
    objects: dict[str, ObjectConfig] = Field(default_factory=dict)
    """Things by name."""


@component("scene")
class Scene(Component[SceneConfig]):
    """Keeps the planning scene, and publishes it whenever it changes; `rbxcompose scene` changes it.

    Example:
        things: {type: scene, urdf: '<robot name="cart"><link name="base"/></robot>'}
    """

    made_by = "A robot with arms runs one."
    joint_states = In(JointState, "joint_states", is_open=True)
    scene = Out(SceneObjects, "scene", qos="latched")

    def configure(self) -> None:
        """Read the body and put the objects into the scene."""
        root = read_urdf(self.config.urdf, "urdf")
        if not isinstance(root, XmlElement):
            raise ValueError(root.message)
        self.positions: dict[str, float] = {}
        objects = (_placed(SceneEntry(name, **one.model_dump())) for name, one in self.config.objects.items())
        self.things = PlanningScene(read_body(root)[0], objects)

    def activate(self) -> None:
        """Publish it."""
        self.publish()

    def on_joint_states(self, message: JointState) -> None:
        """Note where joints are."""
        self.positions.update(zip(message.name, message.position.tolist(), strict=False))

    @answers(ListScene)
    def listed(self, request: ListScene) -> tuple[SceneEntry, ...]:
        """Return all objects."""
        return tuple(
            SceneEntry(one.name, one.shape.kind, one.shape.size, one.link, *_numbers(one.pose), one.touches)
            for one in self.things.objects.values()
        )

    @answers(AddToScene)
    def add(self, request: AddToScene) -> str:
        """Put an object into the scene."""
        one = _placed(replace(request.entry, link=request.entry.link or self.things.body.root))
        self.change(lambda: self.things.add(one))
        return f"'{one.name}' is in the scene, in the frame of '{one.link}'"

    @answers(RemoveFromScene)
    def remove(self, request: RemoveFromScene) -> str:
        """Take an object out of the scene."""
        self.change(lambda: self.things.remove(request.object))
        return f"'{request.object}' is gone"

    @answers(AttachInScene)
    def attach(self, request: AttachInScene) -> str:
        """Let an object move with a link."""
        poses = self.things.body.poses(self.positions)
        self.change(lambda: self.things.attach(request.object, request.link, request.touches, poses))
        return f"'{request.object}' moves with '{request.link}'"

    @answers(DetachInScene)
    def detach(self, request: DetachInScene) -> str:
        """Let an object stay where it is."""
        poses = self.things.body.poses(self.positions)
        self.change(lambda: self.things.detach(request.object, poses))
        return f"'{request.object}' stays where it is"

    def change(self, how: Callable[[], None]) -> None:
        """Change the scene and publish it.

        Raises:
            Refused: if the change cannot be.
        """
        try:
            how()
        except SceneError as error:
            raise Refused(str(error)) from None
        self.publish()

    def publish(self) -> None:
        """Publish all objects."""
        self.scene(SceneObjects(objects=tuple(map(_message, self.things.objects.values()))))


def _placed(entry: SceneEntry) -> PlacedObject:
    pose = Transform3(entry.position, entry.rotation)
    return PlacedObject(entry.name, Geometry(entry.shape, entry.size), entry.link, pose, entry.touches)


def _numbers(pose: Transform3) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    return pose.translation, pose.rotation


def _message(one: PlacedObject) -> SceneObject:
    (x, y, z), (qx, qy, qz, qw) = _numbers(one.pose)
    pose = Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))
    return SceneObject(
        name=one.name,
        shape=one.shape.kind,
        size=np.array(one.shape.size),
        link=one.link,
        pose=pose,
        touches=one.touches,
    )
