"""Arms under the names that programs for MoveIt know."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.config import Config as Model
from rbxcompose.domains.arms.motion.moveit import not_done
from rbxcompose.domains.arms.motion.scene import SCENE_LIMITS
from rbxcompose.msgs.moveit_msgs import (
    ExecuteTrajectory,
    GetMotionPlan,
    MotionPlanResponse,
    MoveGroup,
    MoveItErrorCodes,
    PlanningOptions,
    PlanningScene,
)

MotionGoal = sdk.ServedGoal[Any, Any, Any]


class GroupConfig(Model):
    """An arm."""

    joints: tuple[str, ...] = Field(min_length=1)
    """Its joints."""


class MoveGroupConfig(sdk.Config):
    """The arms of a robot."""

    arms: dict[str, GroupConfig] = Field(min_length=1)
    """Arms by name."""


@sdk.component("move_group")
class MoveGroupServer(sdk.Component[MoveGroupConfig]):
    """Passes goals of programs for MoveIt on to the arm that they name, or whose joints they name.

    The actions are `move_action` and `execute_trajectory`, the service is `plan_kinematic_path`. What an arm cannot do
    it refuses, with one of MoveIt's codes and a text. One goal of each action is carried out at a time.

    Example:
        move_group: {type: move_group, arms: {neck: {joints: [pan]}}}
    """

    made_by = "A robot with arms runs one."
    process = "scene"
    rate = 20.0
    steps_for_goals = True
    move_action = sdk.ServesAction(MoveGroup, "move_action", skill=None, limits=SCENE_LIMITS)
    execute_trajectory = sdk.ServesAction(ExecuteTrajectory, "execute_trajectory", skill=None, limits=SCENE_LIMITS)
    plan_kinematic_path = sdk.Serves(GetMotionPlan, "plan_kinematic_path", skill=None, limits=SCENE_LIMITS)

    @classmethod
    def ports(cls, config: MoveGroupConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports: its own, and those of the arms."""
        found: dict[str, sdk.Port[Any]] = {}
        for name in config.arms:
            found[_move(name)] = sdk.CallsAction(MoveGroup, f"{name}/move_action")
            found[_execute(name)] = sdk.CallsAction(ExecuteTrajectory, f"{name}/execute_trajectory")
        return super().ports(config) | {name: port.named(name) for name, port in found.items()}

    def configure(self) -> None:
        """Begin without goals."""
        self.passed: dict[str, Passed] = {}  # by the port at which they came

    def step(self, dt: float) -> None:
        """Pass new goals on, and the wish to end them."""
        for port in ("move_action", "execute_trajectory"):
            goal, there = self.bound[port].current, self.passed.get(port)
            if there is not None and (goal is not there.goal or goal.cancel_requested):
                there.cancel()
            if goal is not None and (there is None or goal is not there.goal):
                self.pass_on(port, goal)

    def pass_on(self, port: str, goal: MotionGoal) -> None:
        """Send a goal to its arm, or report that there is none."""
        request = goal.request
        if isinstance(request, MoveGroup.Goal):
            result: Any = MoveGroup.Result
            name, wrong = self.named(request.request.group_name)
            to = _move(name)
        else:
            result = ExecuteTrajectory.Result
            name, wrong = self.having(request.trajectory.joint_trajectory.joint_names)
            to = _execute(name)
        if wrong is not None:
            goal.aborted(wrong.message, result(error_code=wrong))
            return
        self.passed[port] = Passed(goal, result)
        self.passed[port].send(self.bound[to], partial(self.ended, port))

    def ended(self, port: str, one: Passed) -> None:
        """Forget a goal that has ended."""
        if self.passed.get(port) is one:
            del self.passed[port]

    def named(self, group: str) -> tuple[str, MoveItErrorCodes | None]:
        """Return the arm of a group, or why there is none; without a name the only one."""
        arms = tuple(self.config.arms)
        if group in arms or (not group and len(arms) == 1):
            return group or arms[0], None
        words = f"there is no group '{group}'" if group else "the request names no group"
        return "", not_done(MoveItErrorCodes.INVALID_GROUP_NAME, f"{words}: {', '.join(arms)}")

    def having(self, joints: tuple[str, ...]) -> tuple[str, MoveItErrorCodes | None]:
        """Return the arm with the fewest joints that has all of these, or why there is none."""
        arms = self.config.arms
        fit = [name for name, arm in arms.items() if joints and set(joints) <= set(arm.joints)]
        if fit:
            return min(fit, key=lambda name: len(arms[name].joints)), None
        words = f"no arm has the joints {', '.join(joints)}" if joints else "the trajectory has no joints"
        return "", not_done(MoveItErrorCodes.INVALID_MOTION_PLAN, words)

    def on_plan_kinematic_path(self, request: GetMotionPlan.Request) -> sdk.Later[GetMotionPlan.Response]:
        """Have an arm plan, and send the plan when it is there."""
        later, wanted = sdk.Later[GetMotionPlan.Response](), request.motion_plan_request
        name, wrong = self.named(wanted.group_name)

        def reply(found: MoveGroup.Result) -> None:
            response = MotionPlanResponse(
                trajectory_start=found.trajectory_start,
                group_name=name,
                trajectory=found.planned_trajectory,
                planning_time=found.planning_time,
                error_code=found.error_code,
            )
            later.reply(GetMotionPlan.Response(motion_plan_response=response))

        def ended(end: sdk.Ended[MoveGroup.Result]) -> None:
            reply(end.result or MoveGroup.Result(error_code=_lost(end)))

        if wrong is None and "move_action" in self.passed:
            wrong = not_done(MoveItErrorCodes.FAILURE, "a goal of 'move_action' is carried out")
        if wrong is not None:
            reply(MoveGroup.Result(error_code=wrong))
        else:
            options = PlanningOptions(plan_only=True, planning_scene_diff=PlanningScene(is_diff=True))
            self.bound[_move(name)](MoveGroup.Goal(request=wanted, planning_options=options), ended)
        return later


class Passed:
    """A goal that an arm carries out for somebody else."""

    def __init__(self, goal: MotionGoal, result: Any) -> None:
        self.goal, self._result = goal, result
        self._sent: sdk.SentGoal | None = None
        self._is_canceled = False

    def send(self, arm: Any, ended: Callable[[Passed], None]) -> None:
        """Send it to the arm; `ended` is called at its end."""

        def on_end(end: sdk.Ended[Any]) -> None:
            ended(self)
            result = end.result or self._result(error_code=_lost(end))
            if end.outcome is sdk.Outcome.SUCCEEDED:
                self.goal.succeeded(result)
            elif self.goal.cancel_requested:
                self.goal.canceled(result)
            else:
                self.goal.aborted(result.error_code.message or str(end.outcome), result)

        self._sent = arm(self.goal.request, on_end, self.goal.feedback)

    def cancel(self) -> None:
        """Ask the arm to end it, once."""
        if self._sent is not None and not self._is_canceled:
            self._is_canceled = True
            self._sent.cancel()


def _lost(end: sdk.Ended[Any]) -> MoveItErrorCodes:
    """Return why there is no result of an arm."""
    return not_done(MoveItErrorCodes.COMMUNICATION_FAILURE, end.message or f"the arm's goal was {end.outcome}")


def _move(name: str) -> str:
    return f"{name}.move"


def _execute(name: str) -> str:
    return f"{name}.execute"
