"""Requests of MoveIt's programs about the kinematics of an arm, and their answers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.collisions import Checker, told
from rbxcompose.motion.inverse_kinematics import PoseSolutions, PoseTarget
from rbxcompose.motion.joint_space import JointSpace
from rbxcompose.motion.kept import Keep
from rbxcompose.motion.pose_search import searched
from rbxcompose.motion.posture import Posture
from rbxcompose.motion.scene_messages import pose_message, pose_of
from rbxcompose.msgs.geometry_msgs import PoseStamped
from rbxcompose.msgs.moveit_msgs import (
    GetPositionFK,
    GetPositionIK,
    JointConstraint,
    MoveItErrorCodes,
    PositionIKRequest,
    RobotState,
)
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Header

Array = NDArray[np.float64]
TRIES = 20  # random positions that the search begins with


@dataclass(frozen=True, slots=True)
class KinematicsQuery:
    """An arm, and where the joints of its body are [rad or m]."""

    name: str
    kinematics: ArmKinematics
    space: JointSpace
    checker: Checker
    positions: Mapping[str, float]

    def forward(self, request: GetPositionFK.Request) -> GetPositionFK.Response:
        """Return where links are in a frame, the root without one; without links, where the tip is."""
        body = self.kinematics.body
        links = request.fk_link_names or (self.kinematics.group.tip,)
        given = request.robot_state.joint_state
        at = {**self.positions, **dict(zip(given.name, given.position.tolist(), strict=False))}
        if wrong := self._mistake(request.header.frame_id, given) or _unknown(links, body.links):
            return GetPositionFK.Response(error_code=wrong)
        poses, frame = body.poses(at), request.header.frame_id or body.root
        back = poses[frame].inverse()
        found = tuple(
            PoseStamped(header=Header(frame_id=frame), pose=pose_message(back.compose(poses[link]))) for link in links
        )
        return GetPositionFK.Response(pose_stamped=found, fk_link_names=tuple(links), error_code=_done())

    def inverse(self, request: PositionIKRequest, seed: int) -> Iterator[GetPositionIK.Response | None]:
        """Yield None while it searches, and then the answer."""
        target, given = request.pose_stamped, request.robot_state.joint_state
        frame = target.header.frame_id
        wrong = self._mistake(frame, given) or self._unfit(request)
        pose = PoseTarget(pose_of(target.pose))
        if wrong or pose.mistake:
            yield GetPositionIK.Response(error_code=wrong or _code(MoveItErrorCodes.NO_IK_SOLUTION, pose.mistake))
            return
        at = {**self.positions, **dict(zip(given.name, given.position.tolist(), strict=False))}
        start = np.array([at[name] for name in self.space.names])
        links = self.kinematics.poses(start)
        pose = PoseTarget((links[frame] if frame else Transform3()).compose(pose.pose))
        is_free = self.checker.is_free if request.avoid_collisions else _always
        space, posture = self._constrained(request.constraints.joint_constraints)
        search = searched(
            self.kinematics, space, pose, start, is_free, seed=seed, posture=posture, restarts=TRIES, enough=1
        )
        while True:
            try:
                next(search)
            except StopIteration as ended:
                yield self._answer(ended.value)
                return
            yield None

    def _constrained(self, wanted: Sequence[JointConstraint]) -> tuple[JointSpace, Posture | None]:
        """Return the joints within what is asked of them, and the positions that are preferred there."""
        ranges = {one.joint_name: _range(one) for one in wanted}
        at = {one.joint_name: one.position for one in wanted}
        space = Keep(joints=ranges).narrowed(self.space)
        return space, Posture.of(space.names, at) if at else None

    def _answer(self, found: PoseSolutions) -> GetPositionIK.Response:
        if found.free:
            names, values = self.space.names, found.free[0]
            state = RobotState(joint_state=JointState(name=names, position=values))
            return GetPositionIK.Response(solution=state, error_code=_done())
        if found.colliding:
            text = told(self.checker.colliding(found.colliding[0]))
            return GetPositionIK.Response(error_code=_code(MoveItErrorCodes.GOAL_IN_COLLISION, text))
        text = f"the tip got within {found.nearest[0] * 100:.1f} cm of it"
        return GetPositionIK.Response(error_code=_code(MoveItErrorCodes.NO_IK_SOLUTION, text))

    def _mistake(self, frame: str, given: JointState) -> MoveItErrorCodes | None:
        """Return what is wrong with a frame or the positions of joints."""
        if frame and (wrong := _unknown((frame,), self.kinematics.body.links)) is not None:
            return _code(MoveItErrorCodes.FRAME_TRANSFORM_FAILURE, wrong.message)
        joints = self.kinematics.body.joints
        known = {**self.positions, **dict.fromkeys(given.name, 0.0)}
        missing = [name for name in self.space.names if name not in known]
        if len(given.name) != len(given.position) or not np.all(np.isfinite(given.position)):
            return _code(MoveItErrorCodes.INVALID_ROBOT_STATE, "there is no finite position for each joint")
        if strange := [name for name in given.name if name not in joints]:
            return _code(MoveItErrorCodes.INVALID_ROBOT_STATE, f"there is no joint '{strange[0]}'")
        if missing:
            text = f"nothing has reported where '{missing[0]}' is"
            return _code(MoveItErrorCodes.INVALID_ROBOT_STATE, text)
        return None

    def _unfit(self, request: PositionIKRequest) -> MoveItErrorCodes | None:
        """Return what is asked for that there is not: other groups, other links, constraints."""
        if request.group_name not in ("", self.name):
            return _code(MoveItErrorCodes.INVALID_GROUP_NAME, f"this arm is '{self.name}'")
        tip, one = self.kinematics.group.tip, request.constraints
        if request.ik_link_name not in ("", tip) or request.ik_link_names or request.pose_stamped_vector:
            return _code(MoveItErrorCodes.INVALID_LINK_NAME, f"poses are those of '{tip}' alone")
        if any((one.position_constraints, one.orientation_constraints, one.visibility_constraints)):
            text = "of constraints, those of joints are taken here: the pose is asked for as it is"
            return _code(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, text)
        wrong = next(filter(None, map(self._unfit_joint, one.joint_constraints)), "")
        return _code(MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, wrong) if wrong else None

    def _unfit_joint(self, wanted: JointConstraint) -> str:
        """Return why a joint cannot be where it is wanted, nothing if it can."""
        name, (low, high) = wanted.joint_name, _range(wanted)
        if name not in self.space.names:
            return f"'{name}' is no joint of the arm '{self.name}'"
        if not (low <= wanted.position <= high and math.isfinite(high - low)):
            return f"'{name}' is wanted nowhere"
        joint = self.space.joints[self.space.names.index(name)]
        if not joint.is_continuous and (high < joint.limits.least or low > joint.limits.greatest):
            return f"'{name}' is wanted at {joint.shown(wanted.position)}, beyond its limits"
        return ""


def busy() -> MoveItErrorCodes:
    """Return that an arm plans or moves."""
    return _code(MoveItErrorCodes.FAILURE, "the arm moves")


def late(seconds: float) -> MoveItErrorCodes:
    """Return that the search took too long."""
    return _code(MoveItErrorCodes.TIMED_OUT, f"nothing was found in {seconds:g} s")


def _unknown(names: tuple[str, ...], known: Mapping[str, object]) -> MoveItErrorCodes | None:
    unknown = [name for name in names if name not in known]
    return _code(MoveItErrorCodes.INVALID_LINK_NAME, f"there is no link '{unknown[0]}'") if unknown else None


def _range(wanted: JointConstraint) -> tuple[float, float]:
    return wanted.position - wanted.tolerance_below, wanted.position + wanted.tolerance_above


def _always(values: Array) -> bool:
    return True


def _code(value: int, text: str) -> MoveItErrorCodes:
    return MoveItErrorCodes(val=value, message=text, source="rbxcompose")


def _done() -> MoveItErrorCodes:
    return MoveItErrorCodes(val=MoveItErrorCodes.SUCCESS)
