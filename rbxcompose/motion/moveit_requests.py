"""Motions as programs for MoveIt ask for them, as goals of an arm; what an arm cannot do is refused with the reason."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3, conjugate, multiply
from rbxcompose.motion.arm_goal import ArmGoal
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.inverse_kinematics import PoseTarget
from rbxcompose.motion.kept import Keep, KeptRange
from rbxcompose.motion.planner import PlannerSettings
from rbxcompose.motion.planner_types import OMPL, PLANNERS
from rbxcompose.motion.scene_messages import pose_of
from rbxcompose.msgs.geometry_msgs import Quaternion
from rbxcompose.msgs.moveit_msgs import (
    Constraints,
    JointConstraint,
    MotionPlanRequest,
    MoveItErrorCodes,
    OrientationConstraint,
    PlanningOptions,
    PositionConstraint,
    RobotState,
)
from rbxcompose.msgs.shape_msgs import SolidPrimitive

LONGEST = 600.0  # [s] of planning
MOST_ATTEMPTS = 100
AS_BEFORE = 0.02  # [rad] by which an orientation to keep may differ from how the tip is turned at the start
STILL = 0.01  # [rad or m] by which a start may differ from where the arm is
PIPELINES = ("", "ompl")
_AFFIXES = ("geometric::", "kConfigDefault")
Triple = tuple[float, float, float]


class RequestError(ValueError):
    """Raised for what an arm cannot do, with one of MoveIt's codes and the reason."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


@dataclass(frozen=True, slots=True)
class MotionWish:
    """A request as an arm takes it. `start` are positions of joints [rad or m] that differ from where they are."""

    goal: ArmGoal
    settings: PlannerSettings
    start: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class RequestReader:
    """Reads requests to one arm whose joints are at `positions` [rad or m]. Each method raises `RequestError`."""

    name: str
    kinematics: ArmKinematics
    settings: PlannerSettings
    positions: Mapping[str, float]

    def wish(self, request: MotionPlanRequest, options: PlanningOptions) -> MotionWish:
        """Return what is asked for."""
        if request.group_name not in ("", self.name):
            raise RequestError(MoveItErrorCodes.INVALID_GROUP_NAME, f"this arm is '{self.name}'")
        _require_plain(request, options)
        start = self._start(request.start_state)
        if start and not options.plan_only:
            words = "the arm is elsewhere than 'start_state': only 'plan_only' begins there"
            raise RequestError(MoveItErrorCodes.START_STATE_INVALID, words)
        if len(request.goal_constraints) != 1:
            words = f"there are {len(request.goal_constraints)} alternatives in 'goal_constraints': one is taken"
            raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, words)
        at = {**self.positions, **start}
        goal = replace(
            self._goal(request.goal_constraints[0]),
            speed=request.max_velocity_scaling_factor or 1.0,
            acceleration=request.max_acceleration_scaling_factor or 1.0,
            keep=self._keep(request.path_constraints, at),
            replans=max(0, options.replan_attempts) if options.replan else 0,
        )
        return MotionWish(goal, self._settings(request), start)

    def _settings(self, request: MotionPlanRequest) -> PlannerSettings:
        time, attempts, own = request.allowed_planning_time, request.num_planning_attempts, self.settings
        if not 0.0 <= time <= LONGEST:
            raise RequestError(MoveItErrorCodes.FAILURE, f"an 'allowed_planning_time' of {time:g} s: up to {LONGEST:g}")
        if attempts > MOST_ATTEMPTS:
            raise RequestError(MoveItErrorCodes.FAILURE, f"{attempts} planning attempts: up to {MOST_ATTEMPTS}")
        planner = planner_of(request.planner_id) if request.planner_id else own.planner
        return replace(own, planner=planner, time=time or own.time, attempts=max(own.attempts, attempts))

    def _start(self, state: RobotState) -> dict[str, float]:
        """Return the joints that are elsewhere than they are measured, with their positions there."""
        if state.multi_dof_joint_state.joint_names or state.attached_collision_objects:
            words = "'start_state' has positions of joints alone; 'planning_scene_diff' attaches objects"
            raise RequestError(MoveItErrorCodes.INVALID_ROBOT_STATE, words)
        names, values = state.joint_state.name, state.joint_state.position.tolist()
        if len(names) != len(values) or not all(map(math.isfinite, values)):
            words = "'start_state' does not have a finite position for each joint"
            raise RequestError(MoveItErrorCodes.INVALID_ROBOT_STATE, words)
        if strange := [name for name in names if name not in self.kinematics.body.joints]:
            raise RequestError(MoveItErrorCodes.INVALID_ROBOT_STATE, f"there is no joint '{strange[0]}'")
        given = dict(zip(names, values, strict=True))
        return {name: at for name, at in given.items() if abs(at - self.positions.get(name, math.inf)) > STILL}

    def _goal(self, wanted: Constraints) -> ArmGoal:
        joints, places, turns = wanted.joint_constraints, wanted.position_constraints, wanted.orientation_constraints
        _require_visible(wanted)
        if joints and not (places or turns):
            tolerance = min(min(one.tolerance_above, one.tolerance_below) for one in joints)
            return ArmGoal(positions={one.joint_name: self._joint(one) for one in joints}, tolerance=tolerance)
        if joints or len(places) > 1 or len(turns) > 1 or not (places or turns):
            words = "a goal is made of positions of joints, or of a position of the tip, an orientation, or both"
            raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, words)
        return self._pose(places[0], turns[0] if turns else None) if places else self._turn(turns[0])

    def _turn(self, turn: OrientationConstraint) -> ArmGoal:
        """Return a goal that asks for an orientation alone."""
        self._require_tip(turn.link_name)
        pose = Transform3(rotation=_rotation(turn.orientation))
        target = PoseTarget(pose, angle_tolerance=min(_tolerances(turn)), any_position=True)
        return ArmGoal(target=target, frame=self._frame(turn.header.frame_id))

    def _joint(self, one: JointConstraint) -> float:
        """Return where a joint is wanted."""
        if one.joint_name not in self.kinematics.group.joints:
            words = f"'{one.joint_name}' is no joint of the arm '{self.name}'"
            raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, words)
        if min(one.tolerance_above, one.tolerance_below) < 0.0 or not math.isfinite(one.position):
            raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, f"'{one.joint_name}' is wanted nowhere")
        return one.position

    def _pose(self, place: PositionConstraint, turn: OrientationConstraint | None) -> ArmGoal:
        frame, offset = self._frame(place.header.frame_id), place.target_point_offset
        self._require_tip(place.link_name)
        middle, tolerance = _region(place)
        if turn is None or all(one >= math.pi for one in _tolerances(turn)):
            if any((offset.x, offset.y, offset.z)):
                words = "a point beside the tip is taken together with an orientation alone"
                raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, words)
            return ArmGoal(target=PoseTarget(middle, True, tolerance), frame=frame)
        self._require_tip(turn.link_name)
        if self._frame(turn.header.frame_id) != frame:
            words = "position and orientation are in different frames"
            raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, words)
        point = Transform3((offset.x, offset.y, offset.z))
        pose = Transform3(middle.translation, _rotation(turn.orientation)).compose(point.inverse())
        return ArmGoal(target=PoseTarget(pose, False, tolerance, min(_tolerances(turn))), frame=frame)

    def _keep(self, wanted: Constraints, at: Mapping[str, float]) -> Keep:
        """Return what is kept on the way, which an arm measures from how its tip is turned at the start."""
        places, turns = wanted.position_constraints, wanted.orientation_constraints
        _require_visible(wanted)
        if len(places) > 1 or len(turns) > 1:
            words = "on the way, one position and one orientation are kept"
            raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, words)
        joints = {}
        for one in wanted.joint_constraints:
            middle = self._joint(one)
            joints[one.joint_name] = (middle - one.tolerance_below, middle + one.tolerance_above)
        frame = self._frame(places[0].header.frame_id) if places else ""
        inside = self._box(places[0]) if places else (None, None, None)
        if not turns:
            return Keep(inside=inside, joints=joints, frame=frame)
        turned, is_along_frame = self._turned(turns[0], at)
        if places and not (is_along_frame and frame == self._frame(turns[0].header.frame_id)):
            words = "position and orientation are kept together only along the axes of one frame"
            raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, words)
        return Keep(turned, inside, joints, frame if places else self.kinematics.group.tip)

    def _box(self, place: PositionConstraint) -> tuple[KeptRange | None, KeptRange | None, KeptRange | None]:
        self._require_tip(place.link_name)
        region, offset = place.constraint_region, place.target_point_offset
        is_box = [one.type for one in region.primitives] == [SolidPrimitive.BOX]
        pose = pose_of(region.primitive_poses[0]) if region.primitive_poses else Transform3()
        if not is_box or region.meshes or any((offset.x, offset.y, offset.z)) or _angle(pose.rotation) > AS_BEFORE:
            words = "on the way, the tip is kept in one box along the axes of its frame"
            raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, words)
        sides = region.primitives[0].dimensions.tolist()
        x, y, z = ((at - side / 2, at + side / 2) for at, side in zip(pose.translation, sides, strict=True))
        return x, y, z

    def _turned(self, turn: OrientationConstraint, at: Mapping[str, float]) -> tuple[Triple, bool]:
        """Return by how much the tip may be turned about its axes, and whether those are the axes of the frame.

        MoveIt turns about the axes of the orientation to keep. An arm turns about those of a link where that is at
        the start; they are the same if the tip has that orientation there. What it differs by, it may turn less.
        """
        self._require_tip(turn.link_name)
        frame, values = self._frame(turn.header.frame_id), [at[name] for name in self.kinematics.group.joints]
        links = self.kinematics.poses(np.array(values))
        base = links[frame].rotation if frame else (0.0, 0.0, 0.0, 1.0)
        wanted = multiply(base, _rotation(turn.orientation))
        away = _angle(multiply(conjugate(wanted), links[self.kinematics.group.tip].rotation))
        tolerances = _tolerances(turn)
        if away > AS_BEFORE or min(tolerances) <= away:
            words = f"the tip is turned by {math.degrees(away):.1f} deg from the orientation to keep: it begins with it"
            raise RequestError(MoveItErrorCodes.START_STATE_VIOLATES_PATH_CONSTRAINTS, words)
        a, b, c = (0.0 if one >= math.pi else one - away for one in tolerances)  # 0 is any
        return (a, b, c), _angle(_rotation(turn.orientation)) <= AS_BEFORE

    def _frame(self, name: str) -> str:
        """Return a frame of a goal: nothing for the root."""
        body = self.kinematics.body
        if name and name not in body.links:
            raise RequestError(MoveItErrorCodes.FRAME_TRANSFORM_FAILURE, f"there is no link '{name}'")
        return "" if name == body.root else name

    def _require_tip(self, link: str) -> None:
        tip = self.kinematics.group.tip
        if link not in ("", tip):
            raise RequestError(MoveItErrorCodes.INVALID_LINK_NAME, f"goals are for '{tip}', not for '{link}'")


def planner_of(name: str) -> str:
    """Return our name of a planner that has that of MoveIt's files, such as `RRTConnectkConfigDefault`."""
    for affix in _AFFIXES:
        name = name.replace(affix, "")
    for own in PLANNERS:
        theirs = OMPL.get(own, own).lower()
        if name.lower() in (own, theirs, theirs.removesuffix("1")):
            return own
    raise RequestError(MoveItErrorCodes.FAILURE, f"there is no planner '{name}': {', '.join(PLANNERS)}")


def _require_plain(request: MotionPlanRequest, options: PlanningOptions) -> None:
    """Refuse what no arm knows."""
    if request.pipeline_id not in PIPELINES:
        raise RequestError(MoveItErrorCodes.FAILURE, f"there is no pipeline '{request.pipeline_id}': ompl")
    odd = {
        "trajectory_constraints": request.trajectory_constraints.constraints,
        "reference_trajectories": request.reference_trajectories,
        "max_cartesian_speed": request.max_cartesian_speed > 0.0,
        "look_around": options.look_around,
    }
    if words := ", ".join(f"'{name}'" for name, is_there in odd.items() if is_there):
        raise RequestError(MoveItErrorCodes.FAILURE, f"an arm knows no {words}")


def _require_visible(wanted: Constraints) -> None:
    if wanted.visibility_constraints:
        raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, "an arm does not know what is visible")


def _region(place: PositionConstraint) -> tuple[Transform3, float]:
    """Return the middle of the part of space where the tip has to be, and how far from it that reaches [m]."""
    region = place.constraint_region
    if len(region.primitives) != 1 or region.meshes or len(region.primitive_poses) > 1:
        raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, "a position is wanted in one sphere or box")
    shape, sizes = region.primitives[0], region.primitives[0].dimensions.tolist()
    wanted = {SolidPrimitive.SPHERE: (1, 1.0), SolidPrimitive.BOX: (3, 0.5)}.get(shape.type)
    if wanted is None or len(sizes) != wanted[0] or not min(sizes) > 0.0:
        raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, "a position is wanted in one sphere or box")
    pose = pose_of(region.primitive_poses[0]) if region.primitive_poses else Transform3()
    return Transform3(pose.translation), min(sizes) * wanted[1]


def _tolerances(turn: OrientationConstraint) -> Triple:
    found = (turn.absolute_x_axis_tolerance, turn.absolute_y_axis_tolerance, turn.absolute_z_axis_tolerance)
    if not min(found) > 0.0:
        raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, "a tolerance of an orientation is not above 0")
    if turn.parameterization != OrientationConstraint.XYZ_EULER_ANGLES and len(set(found)) > 1:
        words = "a rotation vector is taken with one tolerance for all axes"
        raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, words)
    return found


def _rotation(message: Quaternion) -> tuple[float, float, float, float]:
    found = (message.x, message.y, message.z, message.w)
    length = math.hypot(*found)
    if not abs(length - 1.0) <= AS_BEFORE:
        raise RequestError(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, "an orientation is no rotation")
    x, y, z, w = found
    return x / length, y / length, z / length, w / length


def _angle(rotation: Sequence[float]) -> float:
    """Return by how much a rotation turns [rad]."""
    *axis, w = rotation
    return 2.0 * math.atan2(math.hypot(*axis), abs(w))
