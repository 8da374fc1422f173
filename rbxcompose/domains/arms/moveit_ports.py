"""What programs for MoveIt find at an arm: its kinematics, and whole motions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.domains.arms.motion import moveit
from rbxcompose.domains.arms.motion.scene import SCENE_LIMITS, PlacedObject
from rbxcompose.msgs.moveit_msgs import ExecuteTrajectory, GetPositionFK, GetPositionIK, MoveGroup, MoveItErrorCodes
from rbxcompose.msgs.moveit_msgs import PlanningScene as PlanningSceneMessage
from rbxcompose.msgs.stamps import to_seconds
from rbxcompose.sdk import Port, ServedGoal, Serves, ServesAction

FORWARD, INVERSE, MOTION, GIVEN = "forward", "inverse", "motion", "given"  # the ports
IK_TIME = 1.0  # [s] that a search may take; what else it should do waits meanwhile


class ProgrammedArm(moveit.MoveItSite, Protocol):
    """The component of an arm, as far as such programs need it."""

    config: ArmConfig
    works: ArmWorks
    task: Any


def moveit_ports(config: ArmConfig) -> dict[str, Port[Any]]:
    """Return the ports; `move_group` passes on to them what comes under the names of ROS 2."""
    motion: ServesAction[Any, Any, Any] = ServesAction(
        MoveGroup, f"{config.name}/move_action", claims=config.controller, skill=None, limits=SCENE_LIMITS
    )
    given: ServesAction[Any, Any, Any] = ServesAction(
        ExecuteTrajectory,
        f"{config.name}/execute_trajectory",
        claims=config.controller,
        skill=None,
        limits=SCENE_LIMITS,
    )
    return {
        FORWARD: Serves(GetPositionFK, f"{config.name}/compute_fk", skill=None).named(FORWARD),
        INVERSE: Serves(GetPositionIK, f"{config.name}/compute_ik", skill=None).named(INVERSE),
        MOTION: motion.named(MOTION),
        GIVEN: given.named(GIVEN),
    }


def positions_of(arm: ProgrammedArm) -> dict[str, float]:
    """Return where joints are [rad or m]."""
    return {name: position for name, (position, _) in arm.measured.items()}


def query(arm: ProgrammedArm) -> moveit.KinematicsQuery:
    """Return what answers questions about where the arm is or could be."""
    works, positions = arm.works, positions_of(arm)
    works.kinematics.place({name: position for name, position in positions.items() if name not in works.space.names})
    return moveit.KinematicsQuery(arm.config.name, works.kinematics, works.space, works.planner.checker, positions)


class KinematicsServices:
    """The services for the kinematics of an arm, as programs for MoveIt call them."""

    def on_forward(self: ProgrammedArm, request: GetPositionFK.Request) -> GetPositionFK.Response:
        """Return where links are."""
        if self.task is not None:
            return GetPositionFK.Response(error_code=moveit.busy())
        return query(self).forward(request)

    def on_inverse(self: ProgrammedArm, request: GetPositionIK.Request) -> GetPositionIK.Response:
        """Return positions of joints that bring the tip to a pose."""
        if self.task is not None:
            return GetPositionIK.Response(error_code=moveit.busy())
        wanted, begin = request.ik_request, self.now
        most = min(to_seconds(wanted.timeout) or IK_TIME, IK_TIME)
        for answer in query(self).inverse(wanted, self.config.planner.seed):
            if answer is not None:
                return answer
            if self.now - begin > most:
                break
        return GetPositionIK.Response(error_code=moveit.late(most))


def is_turned_away(goal: ServedGoal[Any, Any, Any]) -> bool:
    """Return whether a goal that comes while another one is carried out only wants a plan; then it has ended."""
    if not isinstance(goal.request, MoveGroup.Goal) or not goal.request.planning_options.plan_only:
        return False
    goal.aborted("the arm moves", MoveGroup.Result(error_code=moveit.busy()))
    return True


def moveit_task(arm: ProgrammedArm, message: MoveGroup.Goal | ExecuteTrajectory.Goal) -> moveit.MoveItTask:
    """Return the task of a goal; one that is refused is over."""
    works, task = arm.works, moveit.MoveItTask(arm, arm.works.planner)
    try:
        if isinstance(message, ExecuteTrajectory.Goal):
            _follow(arm, task, message)
        else:
            options, at = message.planning_options, positions_of(arm)
            if missing := [name for name in works.space.names if name not in at]:
                words = f"nothing has reported where '{missing[0]}' is"
                raise moveit.RequestError(MoveItErrorCodes.ROBOT_STATE_STALE, words)
            works.kinematics.place({name: value for name, value in at.items() if name not in works.space.names})
            reader = moveit.RequestReader(arm.config.name, works.kinematics, works.planner.settings, at)
            wish = reader.wish(message.request, options)
            _place(arm, task, options.planning_scene_diff)
            task.plan(works.kinematics, wish, arm.config.kinematics.settings, is_plan=options.plan_only)
    except moveit.RequestError as error:
        task.refuse(error)
    return task


def _follow(arm: ProgrammedArm, task: moveit.MoveItTask, message: ExecuteTrajectory.Goal) -> None:
    """Let the task carry out a given motion."""
    names, at = arm.works.space.names, positions_of(arm)
    if other := [name for name in message.controller_names if name != arm.config.controller]:
        words = f"'{arm.config.controller}' leads this arm, not '{other[0]}'"
        raise moveit.RequestError(MoveItErrorCodes.CONTROL_FAILED, words)
    if missing := [name for name in names if name not in at]:
        raise moveit.RequestError(MoveItErrorCodes.ROBOT_STATE_STALE, f"nothing has reported where '{missing[0]}' is")
    here = np.array([at[name] for name in names])
    task.follow_given(arm.works.kinematics, moveit.trajectory_of(message.trajectory, names, here))


def _place(arm: ProgrammedArm, task: moveit.MoveItTask, difference: PlanningSceneMessage) -> None:
    """Let the arm plan in another scene until the task is over."""
    if moveit.differs(difference):
        task.difference = difference
        arm.works.place_objects(*around(arm, task, arm.works.objects, arm.works.paddings))


def around(
    arm: ProgrammedArm, task: Any, objects: tuple[PlacedObject, ...], paddings: Mapping[str, float]
) -> moveit.SceneAround:
    """Return what is around the robot while it carries out a task; raises `RequestError` if that cannot be."""
    if not isinstance(task, moveit.MoveItTask) or task.difference is None:
        return objects, paddings
    return moveit.with_difference(arm.works.kinematics.body, objects, paddings, task.difference, positions_of(arm))
