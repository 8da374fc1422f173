"""A planning scene that differs from that of the robot for one motion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rbxcompose.body.model import Body
from rbxcompose.motion.moveit_requests import RequestError
from rbxcompose.motion.moveit_scene import MoveItScene
from rbxcompose.motion.scene import PlacedObject, PlanningScene, SceneError
from rbxcompose.msgs.moveit_msgs import MoveItErrorCodes
from rbxcompose.msgs.moveit_msgs import PlanningScene as PlanningSceneMessage

SceneAround = tuple[tuple[PlacedObject, ...], Mapping[str, float]]
"""Objects, and paddings of links [m]."""


def differs(message: PlanningSceneMessage) -> bool:
    """Return whether a message says anything; clients send an empty one with each motion.

    Raises:
        RequestError: if it says what a difference cannot.
    """
    state, matrix, world = message.robot_state, message.allowed_collision_matrix, message.world
    odd = {
        "joint_state": state.joint_state.name or state.multi_dof_joint_state.joint_names,
        "fixed_frame_transforms": message.fixed_frame_transforms,
        "default_entry_names": matrix.default_entry_names,
    }
    if words := ", ".join(f"'{name}'" for name, is_there in odd.items() if is_there):
        raise RequestError(MoveItErrorCodes.FAILURE, f"'planning_scene_diff' has {words}, which is not taken")
    parts = (
        state.attached_collision_objects,
        matrix.entry_names,
        message.link_padding,
        message.link_scale,
        message.object_colors,
        world.collision_objects,
        world.octomap.octomap.data.size,
    )
    return any(parts)


def with_difference(
    body: Body,
    objects: Iterable[PlacedObject],
    paddings: Mapping[str, float],
    difference: PlanningSceneMessage,
    positions: Mapping[str, float],
) -> SceneAround:
    """Return what is around a body whose joints are at `positions` [rad or m] with a difference.

    Raises:
        RequestError: if it cannot be.
    """
    scene = MoveItScene(PlanningScene(body, objects), dict(paddings))
    try:
        scene.apply(difference, body.poses(positions))
    except SceneError as error:
        words = f"'planning_scene_diff' cannot be: {error}"
        raise RequestError(MoveItErrorCodes.INVALID_OBJECT_NAME, words) from error
    return tuple(scene.scene.objects.values()), scene.paddings
