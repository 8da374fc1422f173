"""Changes of the planning scene as programs for MoveIt send them, and the scene as they ask for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rbxcompose.body.model import Geometry
from rbxcompose.geometry import Transform3
from rbxcompose.motion.moveit_objects import collision_object, object_of, pieces_of
from rbxcompose.motion.octree_files import cells_of_octomap
from rbxcompose.motion.scene import PlacedObject, PlanningScene, SceneError, ScenePiece, settled
from rbxcompose.motion.scene_messages import pose_of
from rbxcompose.msgs.moveit_msgs import (
    AllowedCollisionMatrix,
    AttachedCollisionObject,
    CollisionObject,
    LinkPadding,
    ObjectColor,
    PlanningSceneWorld,
    RobotState,
)
from rbxcompose.msgs.moveit_msgs import PlanningScene as PlanningSceneMessage
from rbxcompose.msgs.octomap_msgs import OctomapWithPose
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import ColorRGBA

OCTOMAP = "<octomap>"
"""The name of the object that an octomap becomes, as in MoveIt."""
Poses = Mapping[str, Transform3]


class MoveItScene:
    """Changes a scene, and its paddings of links [m], as messages ask; `poses` are those of links and frames.

    Each method raises `SceneError` for what cannot be; the scene may have changed in part then.
    """

    def __init__(self, scene: PlanningScene, paddings: dict[str, float]) -> None:
        self.scene, self.paddings = scene, paddings

    def change(self, message: CollisionObject) -> None:
        """Add, remove, extend or move an object of the world."""
        there = self.scene.objects.get(message.id)
        match message.operation:
            case CollisionObject.ADD:
                self.scene.put(self._placed(message))
            case CollisionObject.APPEND:
                self.scene.put(self._extended(there, message) if there else self._placed(message))
            case CollisionObject.REMOVE if not message.id:
                self.scene.objects = {name: one for name, one in self.scene.objects.items() if self._is_held(one)}
            case CollisionObject.REMOVE:
                self.scene.remove(message.id)
            case CollisionObject.MOVE:
                if there is None:
                    raise SceneError(f"there is no object '{message.id}' to move")
                if any(pieces_of(message)):
                    raise SceneError(f"'{message.id}' is moved, so the message has no shapes")
                link = message.header.frame_id or self.scene.body.root
                self.scene.put(settled(replace(there, link=link, pose=pose_of(message.pose)), self.scene.body))
            case unknown:
                raise SceneError(f"there is no operation {unknown}")

    def attach(self, message: AttachedCollisionObject, poses: Poses) -> None:
        """Attach an object of the scene, or a new one, to a link; or detach one, without a name all of the link."""
        name = message.object.id
        if message.object.operation == CollisionObject.REMOVE:
            link = message.link_name
            held = [one for one in self.scene.objects.values() if self._is_held(one) and link in ("", one.link)]
            for one in held:
                if name in ("", one.name):
                    self.scene.detach(one.name, poses)
            if name and not any(one.name == name for one in held):
                raise SceneError(f"no link holds '{name}'")
            return
        if any(pieces_of(message.object)):
            self.scene.put(object_of(message.object, message.link_name))
        self.scene.attach(name, message.link_name, message.touch_links, poses)

    def apply(self, message: PlanningSceneMessage, poses: Poses) -> None:
        """Change the scene, or replace it if the message is no difference."""
        if not message.is_diff:
            self.scene.objects = {}
            self.paddings.clear()
        if scaled := [one.link_name for one in message.link_scale if one.scale != 1.0]:
            raise SceneError(f"the link '{scaled[0]}' cannot be scaled: it can be padded")
        for padding in message.link_padding:
            self._pad(padding)
        for one in message.world.collision_objects:
            self.change(one)
        if message.world.octomap.octomap.data.size:
            self._put_octomap(message.world.octomap)
        for attached in message.robot_state.attached_collision_objects:
            self.attach(attached, poses)
        for color in message.object_colors:
            self._colour(color)
        self._allow(message.allowed_collision_matrix)

    def message(self, name: str, positions: Mapping[str, float]) -> PlanningSceneMessage:
        """Return the scene; `positions` are those of joints [rad or m]."""
        objects = self.scene.objects.values()
        held = [one for one in objects if self._is_held(one)]
        state = RobotState(
            joint_state=JointState(name=tuple(positions), position=np.array([*positions.values()])),
            attached_collision_objects=tuple(
                AttachedCollisionObject(link_name=one.link, object=collision_object(one), touch_links=one.touches)
                for one in held
            ),
        )
        return PlanningSceneMessage(
            name=name,
            robot_model_name=self.scene.body.name,
            robot_state=state,
            link_padding=tuple(LinkPadding(link_name=link, padding=one) for link, one in self.paddings.items()),
            object_colors=tuple(ObjectColor(id=one.name, color=_color(one)) for one in objects if one.colour),
            world=PlanningSceneWorld(
                collision_objects=tuple(collision_object(one) for one in objects if one not in held)
            ),
        )

    def _is_held(self, one: PlacedObject) -> bool:
        return one.link in self.scene.body.links and one.link != self.scene.body.root

    def _placed(self, message: CollisionObject) -> PlacedObject:
        """Return the object of a message; a link that never moves does not hold it."""
        return settled(object_of(message, self.scene.body.root), self.scene.body)

    def _extended(self, there: PlacedObject, message: CollisionObject) -> PlacedObject:
        """Return an object with further shapes; those of the message may be in another frame or at another pose.

        The object stays where it is, and so do the shapes.
        """
        new = self._placed(message)
        if new.link != there.link:
            raise SceneError(f"'{there.name}' is in the frame of '{there.link}', and so are its further shapes")
        moved = there.pose.inverse().compose(new.pose)
        added = (ScenePiece(one.shape, moved.compose(one.pose)) for one in new.own_pieces)
        return replace(there, pieces=(*there.pieces, *added))

    def _pad(self, padding: LinkPadding) -> None:
        if padding.link_name not in self.scene.body.links:
            raise SceneError(f"there is no link '{padding.link_name}'")
        if not 0.0 <= padding.padding <= 1.0:
            raise SceneError(f"the padding of '{padding.link_name}' is {padding.padding:g} m: from 0 to 1 m")
        self.paddings[padding.link_name] = padding.padding

    def _put_octomap(self, message: OctomapWithPose) -> None:
        tree = message.octomap
        if not tree.binary or tree.id != "OcTree":
            raise SceneError("an octomap is taken as a binary OcTree alone")
        try:
            cells = cells_of_octomap(tree.data.tobytes(), tree.resolution)
        except ValueError as error:
            raise SceneError(f"the octomap cannot be read: {error}") from error
        shape = Geometry("octree", (tree.resolution,), points=tuple(cells.flatten().tolist()))
        link = message.header.frame_id or self.scene.body.root
        self.scene.put(settled(PlacedObject(OCTOMAP, shape, link, pose_of(message.origin)), self.scene.body))

    def _colour(self, message: ObjectColor) -> None:
        if (one := self.scene.objects.get(message.id)) is None:
            raise SceneError(f"there is no object '{message.id}' to colour")
        color = message.color
        self.scene.put(replace(one, colour=(color.r, color.g, color.b, color.a)))

    def _allow(self, matrix: AllowedCollisionMatrix) -> None:
        """Let objects touch what the matrix says; its pairs of links are those of the robot, which knows its own."""
        names = matrix.entry_names
        for name, row in zip(names, matrix.entry_values, strict=False):
            if (one := self.scene.objects.get(name)) is not None:
                allowed = [other for other, is_allowed in zip(names, row.enabled, strict=False) if is_allowed]
                links = tuple(other for other in allowed if other in self.scene.body.links)
                others = tuple(other for other in allowed if other in self.scene.objects and other != name)
                self.scene.put(replace(one, touches=links, touches_objects=others))


def _color(one: PlacedObject) -> ColorRGBA:
    red, green, blue, alpha = one.colour or (0.0, 0.0, 0.0, 0.0)
    return ColorRGBA(r=red, g=green, b=blue, a=alpha)
