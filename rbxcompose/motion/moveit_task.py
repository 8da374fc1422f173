"""A goal of a program for MoveIt: as a goal of an arm, with the plan and the motion that its result tells."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np

from rbxcompose.motion.arm_goal import ArmGoal
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.arm_task import ArmSite, ArmTask
from rbxcompose.motion.given_task import GivenTask
from rbxcompose.motion.inverse_kinematics import SolverSettings
from rbxcompose.motion.moveit_requests import MotionWish, RequestError
from rbxcompose.motion.moveit_results import code_of, motion_message, not_done, trace_message
from rbxcompose.motion.parametrisation import Trajectory
from rbxcompose.motion.planner import MotionPlanner
from rbxcompose.motion.reasons import MotionFailure, MotionReason
from rbxcompose.msgs.moveit_msgs import ExecuteTrajectory, MoveGroup, MoveItErrorCodes, PlanningScene, RobotState
from rbxcompose.msgs.sensor_msgs import JointState

MOST_SAMPLES = 20_000  # of a motion that was carried out
JointReadings = Mapping[str, tuple[float, float]]


class MoveItSite(ArmSite, Protocol):
    """What such a goal needs of the component that carries it out."""

    def show(self, names: tuple[str, ...], trajectory: Trajectory) -> None:
        """Tell viewers a motion."""


class MoveItTask:
    """One goal. Call `advance` until `is_over`; then `result` tells how it ended.

    It is the site of the task that does the work. With `plan_only`, that finds its joints at `start` and has its
    trajectory noted instead of followed.
    """

    stage = ""

    def __init__(self, site: MoveItSite, planner: MotionPlanner) -> None:
        self._site, self._planner, self._own = site, planner, planner.settings
        self.difference: PlanningScene | None = None
        """By which the scene differs from that of the robot until it is over."""
        self._task: ArmTask | None = None
        self._refusal: MoveItErrorCodes | None = None
        self._start: dict[str, float] = {}
        self._is_plan = False
        self._began = self._planned_at = site.now
        self._begin_state = RobotState()
        self._planned: Trajectory | None = None
        self._times: list[float] = []
        self._rows: list[list[float]] = []

    def refuse(self, error: RequestError) -> None:
        """End it before it begins."""
        self._refusal = not_done(error.code, str(error))

    def plan(self, kinematics: ArmKinematics, wish: MotionWish, solver: SolverSettings, *, is_plan: bool) -> None:
        """Let it plan as is wished, and move unless only the plan is wanted."""
        self._is_plan, self._start, self._planner.settings = is_plan, dict(wish.start), wish.settings
        self._task = ArmTask(self, kinematics, self._planner, wish.goal, solver)

    def follow_given(self, kinematics: ArmKinematics, given: Trajectory) -> None:
        """Let it verify a motion and move."""
        self._task = task = GivenTask(self, kinematics, self._planner, ArmGoal())
        task.given = given

    def advance(self) -> None:
        """Continue."""
        if self._task is not None:
            self._sample()
            self._task.advance()

    def cancel(self) -> None:
        """End it soon."""
        if self._task is not None:
            self._task.cancel()

    def look_again(self) -> None:
        """Stop if the motion would hit something that has come."""
        if self._task is not None:
            self._task.look_again()

    @property
    def is_over(self) -> bool:
        """Return whether it has ended."""
        return self._refusal is not None or (self._task is not None and self._task.is_over)

    @property
    def failure(self) -> MotionFailure | None:
        """Return why it failed, if it did."""
        if self._refusal is not None:
            return MotionFailure(MotionReason.UNKNOWN_GOAL, self._refusal.message)
        return self._task.failure if self._task is not None else None

    def end(self) -> None:
        """Plan as before again."""
        self._planner.settings = self._own

    @property
    def code(self) -> MoveItErrorCodes:
        """Return how it ended."""
        return self._refusal or code_of(self.failure, is_moving=bool(self._rows))

    def result(self, action: type[MoveGroup | ExecuteTrajectory]) -> MoveGroup.Result | ExecuteTrajectory.Result:
        """Return the result of its goal."""
        if action is ExecuteTrajectory:
            return ExecuteTrajectory.Result(error_code=self.code)
        found = MoveGroup.Result(error_code=self.code)
        if self._task is None:
            return found
        names = self._planner.space.names
        planned = self._planned
        if planned is None and self.failure is None:  # the arm is where it should be
            here = np.array([[self.measured[name][0] for name in names]])
            planned = Trajectory(np.zeros(1), here, np.zeros_like(here))
        return MoveGroup.Result(
            error_code=self.code,
            trajectory_start=self._begin_state,
            planned_trajectory=motion_message(names, planned) if planned is not None else found.planned_trajectory,
            executed_trajectory=trace_message(names, self._times, self._rows),
            planning_time=self._planned_at - self._began,
        )

    def _sample(self) -> None:
        """Note where the arm is on its way."""
        if self._planned is not None and not self._is_plan and len(self._rows) < MOST_SAMPLES:
            self._times.append(self.now - self._planned_at)
            self._rows.append([self.measured[name][0] for name in self._planner.space.names])

    # What its task needs

    @property
    def now(self) -> float:
        """Return robot time [s]."""
        return self._site.now

    @property
    def measured(self) -> JointReadings:
        """Return position and velocity of joints, where they are or where a plan is to begin."""
        elsewhere = {name: (at, 0.0) for name, at in self._start.items()}
        return {**self._site.measured, **elsewhere} if elsewhere else self._site.measured

    @property
    def poses(self) -> Mapping[str, Mapping[str, float]]:
        """Return the poses by name."""
        return self._site.poses

    @property
    def is_ready(self) -> bool:
        """Return whether it is known what is around the robot."""
        return self._site.is_ready

    @property
    def problem(self) -> str:
        """Return why that is not known."""
        return self._site.problem

    def follow(self, names: tuple[str, ...], trajectory: Trajectory, ended: Callable[[str, bool], None]) -> None:
        """Have a trajectory followed, or only shown."""
        if self._planned is None:  # else it is planned again, on its way
            self._planned, self._planned_at = trajectory, self.now
            at = self.measured
            state = JointState(name=tuple(at), position=np.array([position for position, _ in at.values()]))
            self._begin_state = RobotState(joint_state=state)
        if self._is_plan:
            self._site.show(names, trajectory)
            ended("", False)
        else:
            self._sample()
            self._site.follow(names, trajectory, ended)

    def stop_following(self) -> None:
        """Ask the controller to end the trajectory."""
        self._site.stop_following()

    def told(self, stage: str) -> None:
        """Tell in which stage it is."""
        self.stage = stage
        self._site.told(stage)

    def info(self, text: str) -> None:
        """Log an event."""
        self._site.info(text)
