"""What programs for MoveIt ask of an arm and what they get: requests, scenes, kinematics, motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import Protocol

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import NO_ROTATION, Transform3, angle_between, multiply
from rbxcompose.domains.arms.motion import scene as scenes
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.arm_task import ArmGoal, ArmSite, ArmTask, GivenTask
from rbxcompose.domains.arms.motion.collisions import Checker, pairs_shown
from rbxcompose.domains.arms.motion.groups import JointSpace
from rbxcompose.domains.arms.motion.inverse_kinematics import (
    PoseSearch,
    PoseSolutions,
    PoseTarget,
    Posture,
    SolverSettings,
    searched,
)
from rbxcompose.domains.arms.motion.octree_files import cells_of_octomap
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.path_constraints import Keep, KeptRange
from rbxcompose.domains.arms.motion.planner import MotionPlanner, PlannerSettings
from rbxcompose.domains.arms.motion.scene_messages import colour_message, joint_trajectory
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason
from rbxcompose.domains.arms.section_models import OMPL, PLANNERS
from rbxcompose.domains.body.model import Body, Geometry
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped, Quaternion
from rbxcompose.msgs.moveit_msgs import (
    AllowedCollisionMatrix,
    AttachedCollisionObject,
    CollisionObject,
    Constraints,
    ExecuteTrajectory,
    GetPositionFK,
    GetPositionIK,
    JointConstraint,
    LinkPadding,
    MotionPlanRequest,
    MoveGroup,
    ObjectColor,
    OrientationConstraint,
    PlanningOptions,
    PlanningSceneWorld,
    PositionConstraint,
    PositionIKRequest,
    RobotState,
    RobotTrajectory,
)
from rbxcompose.msgs.moveit_msgs import MoveItErrorCodes as Codes
from rbxcompose.msgs.moveit_msgs import PlanningScene as PlanningSceneMessage
from rbxcompose.msgs.octomap_msgs import OctomapWithPose
from rbxcompose.msgs.poses import pose_message, pose_of
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.shape_msgs import Mesh, MeshTriangle, Plane, SolidPrimitive
from rbxcompose.msgs.stamps import to_duration, to_seconds
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint

KINDS = {
    SolidPrimitive.BOX: "box",
    SolidPrimitive.SPHERE: "sphere",
    SolidPrimitive.CYLINDER: "cylinder",
    SolidPrimitive.CONE: "cone",
}
_LENGTH_FIRST = ("cylinder", "cone")  # MoveIt's sizes are height and radius, ours radius and length
_NUMBERS = {kind: number for number, kind in KINDS.items()}


def object_of(message: CollisionObject, root: str) -> scenes.PlacedObject:
    """Return the object of a message; without a frame it stands in that of the root.

    Raises:
        SceneError: if it has no shapes, or one that there is not.
    """
    pieces = list(pieces_of(message))
    if not pieces:
        raise scenes.SceneError(f"'{message.id}' has no shapes")
    return scenes.PlacedObject.of(message.id, message.header.frame_id or root, pose_of(message.pose), pieces)


def pieces_of(message: CollisionObject) -> Iterator[scenes.ScenePiece]:
    """Yield the shapes of a message, in the frame of the object; raises as `object_of` does."""
    yield from _placed([_primitive(primitive) for primitive in message.primitives], message.primitive_poses)
    yield from _placed([_mesh(mesh) for mesh in message.meshes], message.mesh_poses)
    yield from _placed([Geometry("plane", tuple(plane.coef.tolist())) for plane in message.planes], message.plane_poses)


def _placed(shapes: Sequence[Geometry], poses: Sequence[Pose]) -> Iterator[scenes.ScenePiece]:
    """Yield shapes with their poses; without any poses, all are where the object is."""
    if poses and len(poses) != len(shapes):
        raise scenes.SceneError(f"it has {len(shapes)} shapes of one kind and {len(poses)} poses of them")
    for shape, pose in zip_longest(shapes, poses):
        yield scenes.ScenePiece(shape, Transform3() if pose is None else pose_of(pose))


def _primitive(message: SolidPrimitive) -> Geometry:
    kind, size = KINDS.get(message.type, ""), message.dimensions.tolist()
    if not kind:
        raise scenes.SceneError(f"there is no shape of the type {message.type}: {', '.join(KINDS.values())}")
    return Geometry(kind, tuple(reversed(size)) if kind in _LENGTH_FIRST else tuple(size))


def _mesh(message: Mesh) -> Geometry:
    if max(len(message.vertices), len(message.triangles)) > 2 * scenes.MOST_POINTS:
        raise scenes.SceneError(
            f"its mesh has {len(message.vertices):,} corners and {len(message.triangles):,} triangles"
        )
    points = tuple(value for vertex in message.vertices for value in (vertex.x, vertex.y, vertex.z))
    triangles = tuple(value for triangle in message.triangles for value in triangle.vertex_indices.tolist())
    return Geometry("mesh", (1.0, 1.0, 1.0), points=points, triangles=triangles)


def collision_object(thing: scenes.PlacedObject) -> CollisionObject:
    """Return an object as a message; meshes in files and octrees, which it cannot hold, are left out."""
    pieces = thing.own_pieces
    simple = [each for each in pieces if each.shape.kind in _NUMBERS]
    meshes = [each for each in pieces if each.shape.kind == "mesh" and each.shape.points]
    planes = [each for each in pieces if each.shape.kind == "plane"]
    return CollisionObject(
        header=Header(frame_id=thing.link),
        pose=pose_message(thing.pose),
        id=thing.name,
        primitives=tuple(_primitive_message(each.shape) for each in simple),
        primitive_poses=tuple(pose_message(each.pose) for each in simple),
        meshes=tuple(_mesh_message(each.shape) for each in meshes),
        mesh_poses=tuple(pose_message(each.pose) for each in meshes),
        planes=tuple(Plane(coef=np.array(each.shape.size)) for each in planes),
        plane_poses=tuple(pose_message(each.pose) for each in planes),
    )


def _primitive_message(shape: Geometry) -> SolidPrimitive:
    size = tuple(reversed(shape.size)) if shape.kind in _LENGTH_FIRST else shape.size
    return SolidPrimitive(type=_NUMBERS[shape.kind], dimensions=np.array(size, dtype=np.float64))


def _mesh_message(shape: Geometry) -> Mesh:
    corners = np.array(shape.points).reshape(-1, 3) * shape.size
    triangles = np.array(shape.triangles, dtype=np.uint32).reshape(-1, 3)
    return Mesh(
        triangles=tuple(MeshTriangle(vertex_indices=triangle) for triangle in triangles),
        vertices=tuple(Point(x=x, y=y, z=z) for x, y, z in corners.tolist()),
    )


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


def _bad_goal(text: str) -> RequestError:
    return RequestError(Codes.INVALID_GOAL_CONSTRAINTS, text)


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
            raise RequestError(Codes.INVALID_GROUP_NAME, f"this arm is '{self.name}'")
        _require_plain(request, options)
        start = self._start(request.start_state)
        if start and not options.plan_only:
            words = "the arm is elsewhere than 'start_state': only 'plan_only' begins there"
            raise RequestError(Codes.START_STATE_INVALID, words)
        if len(request.goal_constraints) != 1:
            words = f"there are {len(request.goal_constraints)} alternatives in 'goal_constraints': one is taken"
            raise _bad_goal(words)
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
            raise RequestError(Codes.FAILURE, f"an 'allowed_planning_time' of {time:g} s: up to {LONGEST:g}")
        if attempts > MOST_ATTEMPTS:
            raise RequestError(Codes.FAILURE, f"{attempts} planning attempts: up to {MOST_ATTEMPTS}")
        planner = planner_of(request.planner_id) if request.planner_id else own.planner
        return replace(own, planner=planner, time=time or own.time, attempts=max(own.attempts, attempts))

    def _start(self, state: RobotState) -> dict[str, float]:
        """Return the joints that are elsewhere than they are measured, with their positions there."""
        if state.multi_dof_joint_state.joint_names or state.attached_collision_objects:
            words = "'start_state' has positions of joints alone; 'planning_scene_diff' attaches objects"
            raise RequestError(Codes.INVALID_ROBOT_STATE, words)
        names, values = state.joint_state.name, state.joint_state.position.tolist()
        if len(names) != len(values) or not all(map(math.isfinite, values)):
            words = "'start_state' does not have a finite position for each joint"
            raise RequestError(Codes.INVALID_ROBOT_STATE, words)
        if strange := [name for name in names if name not in self.kinematics.body.joints]:
            raise RequestError(Codes.INVALID_ROBOT_STATE, f"there is no joint '{strange[0]}'")
        given = dict(zip(names, values, strict=True))
        return {name: at for name, at in given.items() if abs(at - self.positions.get(name, math.inf)) > STILL}

    def _goal(self, wanted: Constraints) -> ArmGoal:
        joints, places, turns = wanted.joint_constraints, wanted.position_constraints, wanted.orientation_constraints
        _require_visible(wanted)
        if joints and not (places or turns):
            tolerance = min(min(joint.tolerance_above, joint.tolerance_below) for joint in joints)
            return ArmGoal(positions={joint.joint_name: self._joint(joint) for joint in joints}, tolerance=tolerance)
        if joints or len(places) > 1 or len(turns) > 1 or not (places or turns):
            words = "a goal is made of positions of joints, or of a position of the tip, an orientation, or both"
            raise _bad_goal(words)
        return self._pose(places[0], turns[0] if turns else None) if places else self._turn(turns[0])

    def _turn(self, turn: OrientationConstraint) -> ArmGoal:
        """Return a goal that asks for an orientation alone."""
        self._require_tip(turn.link_name)
        pose = Transform3(rotation=_rotation(turn.orientation))
        target = PoseTarget(pose, angle_tolerance=min(_tolerances(turn)), any_position=True)
        return ArmGoal(target=target, frame=self._frame(turn.header.frame_id))

    def _joint(self, constraint: JointConstraint) -> float:
        """Return where a joint is wanted."""
        if constraint.joint_name not in self.kinematics.group.joints:
            raise _bad_goal(f"'{constraint.joint_name}' is no joint of the arm '{self.name}'")
        if min(constraint.tolerance_above, constraint.tolerance_below) < 0.0 or not math.isfinite(constraint.position):
            raise _bad_goal(f"'{constraint.joint_name}' is wanted nowhere")
        return constraint.position

    def _pose(self, place: PositionConstraint, turn: OrientationConstraint | None) -> ArmGoal:
        frame, offset = self._frame(place.header.frame_id), place.target_point_offset
        self._require_tip(place.link_name)
        middle, tolerance = _region(place)
        if turn is None or all(one >= math.pi for one in _tolerances(turn)):
            if any((offset.x, offset.y, offset.z)):
                raise _bad_goal("a point beside the tip is taken together with an orientation alone")
            return ArmGoal(target=PoseTarget(middle, True, tolerance), frame=frame)
        self._require_tip(turn.link_name)
        if self._frame(turn.header.frame_id) != frame:
            raise _bad_goal("position and orientation are in different frames")
        point = Transform3((offset.x, offset.y, offset.z))
        pose = Transform3(middle.translation, _rotation(turn.orientation)).compose(point.inverse())
        return ArmGoal(target=PoseTarget(pose, False, tolerance, min(_tolerances(turn))), frame=frame)

    def _keep(self, wanted: Constraints, at: Mapping[str, float]) -> Keep:
        """Return what is kept on the way, which an arm measures from how its tip is turned at the start."""
        places, turns = wanted.position_constraints, wanted.orientation_constraints
        _require_visible(wanted)
        if len(places) > 1 or len(turns) > 1:
            raise _bad_goal("on the way, one position and one orientation are kept")
        joints = {}
        for constraint in wanted.joint_constraints:
            middle = self._joint(constraint)
            joints[constraint.joint_name] = (middle - constraint.tolerance_below, middle + constraint.tolerance_above)
        frame = self._frame(places[0].header.frame_id) if places else ""
        inside = self._box(places[0]) if places else (None, None, None)
        if not turns:
            return Keep(inside=inside, joints=joints, frame=frame)
        turned, is_along_frame = self._turned(turns[0], at)
        if places and not (is_along_frame and frame == self._frame(turns[0].header.frame_id)):
            raise _bad_goal("position and orientation are kept together only along the axes of one frame")
        return Keep(turned, inside, joints, frame if places else self.kinematics.group.tip)

    def _box(self, place: PositionConstraint) -> tuple[KeptRange | None, KeptRange | None, KeptRange | None]:
        self._require_tip(place.link_name)
        region, offset = place.constraint_region, place.target_point_offset
        is_box = [primitive.type for primitive in region.primitives] == [SolidPrimitive.BOX]
        pose = pose_of(region.primitive_poses[0]) if region.primitive_poses else Transform3()
        is_turned = angle_between(NO_ROTATION, pose.rotation) > AS_BEFORE
        if not is_box or region.meshes or any((offset.x, offset.y, offset.z)) or is_turned:
            raise _bad_goal("on the way, the tip is kept in one box along the axes of its frame")
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
        base = links[frame].rotation if frame else NO_ROTATION
        wanted = multiply(base, _rotation(turn.orientation))
        away = angle_between(wanted, links[self.kinematics.group.tip].rotation)
        tolerances = _tolerances(turn)
        if away > AS_BEFORE or min(tolerances) <= away:
            words = f"the tip is turned by {math.degrees(away):.1f} deg from the orientation to keep: it begins with it"
            raise RequestError(Codes.START_STATE_VIOLATES_PATH_CONSTRAINTS, words)
        a, b, c = (0.0 if tolerance >= math.pi else tolerance - away for tolerance in tolerances)  # 0 is any
        return (a, b, c), angle_between(NO_ROTATION, _rotation(turn.orientation)) <= AS_BEFORE

    def _frame(self, name: str) -> str:
        """Return a frame of a goal: nothing for the root."""
        body = self.kinematics.body
        if name and name not in body.links:
            raise RequestError(Codes.FRAME_TRANSFORM_FAILURE, f"there is no link '{name}'")
        return "" if name == body.root else name

    def _require_tip(self, link: str) -> None:
        tip = self.kinematics.group.tip
        if link not in ("", tip):
            raise RequestError(Codes.INVALID_LINK_NAME, f"goals are for '{tip}', not for '{link}'")


def planner_of(name: str) -> str:
    """Return our name of a planner that has that of MoveIt's files, such as `RRTConnectkConfigDefault`."""
    for affix in _AFFIXES:
        name = name.replace(affix, "")
    for own in PLANNERS:
        theirs = OMPL.get(own, own).lower()
        if name.lower() in (own, theirs, theirs.removesuffix("1")):
            return own
    raise RequestError(Codes.FAILURE, f"there is no planner '{name}': {', '.join(PLANNERS)}")


def _require_plain(request: MotionPlanRequest, options: PlanningOptions) -> None:
    """Refuse what no arm knows."""
    if request.pipeline_id not in PIPELINES:
        raise RequestError(Codes.FAILURE, f"there is no pipeline '{request.pipeline_id}': ompl")
    odd = {
        "trajectory_constraints": request.trajectory_constraints.constraints,
        "reference_trajectories": request.reference_trajectories,
        "max_cartesian_speed": request.max_cartesian_speed > 0.0,
        "look_around": options.look_around,
    }
    if words := ", ".join(f"'{name}'" for name, is_there in odd.items() if is_there):
        raise RequestError(Codes.FAILURE, f"an arm knows no {words}")


def _require_visible(wanted: Constraints) -> None:
    if wanted.visibility_constraints:
        raise _bad_goal("an arm does not know what is visible")


def _region(place: PositionConstraint) -> tuple[Transform3, float]:
    """Return the middle of the part of space where the tip has to be, and how far from it that reaches [m]."""
    region = place.constraint_region
    if len(region.primitives) != 1 or region.meshes or len(region.primitive_poses) > 1:
        raise _bad_goal("a position is wanted in one sphere or box")
    shape, sizes = region.primitives[0], region.primitives[0].dimensions.tolist()
    wanted = {SolidPrimitive.SPHERE: (1, 1.0), SolidPrimitive.BOX: (3, 0.5)}.get(shape.type)
    if wanted is None or len(sizes) != wanted[0] or not min(sizes) > 0.0:
        raise _bad_goal("a position is wanted in one sphere or box")
    pose = pose_of(region.primitive_poses[0]) if region.primitive_poses else Transform3()
    return Transform3(pose.translation), min(sizes) * wanted[1]


def _tolerances(turn: OrientationConstraint) -> Triple:
    found = (turn.absolute_x_axis_tolerance, turn.absolute_y_axis_tolerance, turn.absolute_z_axis_tolerance)
    if not min(found) > 0.0:
        raise _bad_goal("a tolerance of an orientation is not above 0")
    if turn.parameterization != OrientationConstraint.XYZ_EULER_ANGLES and len(set(found)) > 1:
        raise _bad_goal("a rotation vector is taken with one tolerance for all axes")
    return found


def _rotation(message: Quaternion) -> tuple[float, float, float, float]:
    found = (message.x, message.y, message.z, message.w)
    length = math.hypot(*found)
    if not abs(length - 1.0) <= AS_BEFORE:
        raise _bad_goal("an orientation is no rotation")
    x, y, z, w = found
    return x / length, y / length, z / length, w / length


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
            yield GetPositionIK.Response(error_code=wrong or not_done(Codes.NO_IK_SOLUTION, pose.mistake))
            return
        at = {**self.positions, **dict(zip(given.name, given.position.tolist(), strict=False))}
        start = np.array([at[name] for name in self.space.names])
        links = self.kinematics.poses(start)
        pose = PoseTarget((links[frame] if frame else Transform3()).compose(pose.pose))
        is_free = self.checker.is_free if request.avoid_collisions else lambda values: True
        space, posture = self._constrained(request.constraints.joint_constraints)
        search = PoseSearch(self.kinematics, space, pose, start, is_free, seed, TRIES, 1)
        yield self._answer((yield from searched(search, posture)))

    def _constrained(self, wanted: Sequence[JointConstraint]) -> tuple[JointSpace, Posture | None]:
        """Return the joints within what is asked of them, and the positions that are preferred there."""
        ranges = {constraint.joint_name: _range(constraint) for constraint in wanted}
        at = {constraint.joint_name: constraint.position for constraint in wanted}
        space = Keep(joints=ranges).narrowed(self.space)
        return space, Posture.of(space.names, at) if at else None

    def _answer(self, found: PoseSolutions) -> GetPositionIK.Response:
        if found.free:
            names, values = self.space.names, found.free[0]
            state = RobotState(joint_state=JointState(name=names, position=values))
            return GetPositionIK.Response(solution=state, error_code=_done())
        if found.colliding:
            text = pairs_shown(self.checker.colliding(found.colliding[0]))
            return GetPositionIK.Response(error_code=not_done(Codes.GOAL_IN_COLLISION, text))
        text = f"the tip got within {found.nearest[0] * 100:.1f} cm of it"
        return GetPositionIK.Response(error_code=not_done(Codes.NO_IK_SOLUTION, text))

    def _mistake(self, frame: str, given: JointState) -> Codes | None:
        """Return what is wrong with a frame or the positions of joints."""
        if frame and (wrong := _unknown((frame,), self.kinematics.body.links)) is not None:
            return not_done(Codes.FRAME_TRANSFORM_FAILURE, wrong.message)
        joints = self.kinematics.body.joints
        known = {**self.positions, **dict.fromkeys(given.name, 0.0)}
        missing = [name for name in self.space.names if name not in known]
        if len(given.name) != len(given.position) or not np.all(np.isfinite(given.position)):
            return not_done(Codes.INVALID_ROBOT_STATE, "there is no finite position for each joint")
        if strange := [name for name in given.name if name not in joints]:
            return not_done(Codes.INVALID_ROBOT_STATE, f"there is no joint '{strange[0]}'")
        if missing:
            return not_done(Codes.INVALID_ROBOT_STATE, f"nothing has reported where '{missing[0]}' is")
        return None

    def _unfit(self, request: PositionIKRequest) -> Codes | None:
        """Return what is asked for that there is not: other groups, other links, constraints."""
        if request.group_name not in ("", self.name):
            return not_done(Codes.INVALID_GROUP_NAME, f"this arm is '{self.name}'")
        tip, one = self.kinematics.group.tip, request.constraints
        if request.ik_link_name not in ("", tip) or request.ik_link_names or request.pose_stamped_vector:
            return not_done(Codes.INVALID_LINK_NAME, f"poses are those of '{tip}' alone")
        if any((one.position_constraints, one.orientation_constraints, one.visibility_constraints)):
            text = "of constraints, those of joints are taken here: the pose is asked for as it is"
            return not_done(Codes.INVALID_GOAL_CONSTRAINTS, text)
        wrong = next(filter(None, map(self._unfit_joint, one.joint_constraints)), "")
        return not_done(Codes.INVALID_GOAL_CONSTRAINTS, wrong) if wrong else None

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


def busy() -> Codes:
    """Return that an arm plans or moves."""
    return not_done(Codes.FAILURE, "the arm moves")


def late(seconds: float) -> Codes:
    """Return that the search took too long."""
    return not_done(Codes.TIMED_OUT, f"nothing was found in {seconds:g} s")


def _unknown(names: tuple[str, ...], known: Mapping[str, object]) -> Codes | None:
    unknown = [name for name in names if name not in known]
    return not_done(Codes.INVALID_LINK_NAME, f"there is no link '{unknown[0]}'") if unknown else None


def _range(wanted: JointConstraint) -> tuple[float, float]:
    return wanted.position - wanted.tolerance_below, wanted.position + wanted.tolerance_above


def _done() -> Codes:
    return Codes(val=Codes.SUCCESS)


OCTOMAP = "<octomap>"
"""The name of the object that an octomap becomes, as in MoveIt."""
Poses = Mapping[str, Transform3]


class MoveItScene:
    """Changes a scene, and its paddings of links [m], as messages ask; `poses` are those of links and frames.

    Each method raises `SceneError` for what cannot be; the scene may have changed in part then.
    """

    def __init__(self, scene: scenes.PlanningScene, paddings: dict[str, float]) -> None:
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
                self.scene.objects = {
                    name: item for name, item in self.scene.objects.items() if self.scene.is_held(item)
                }
            case CollisionObject.REMOVE:
                self.scene.remove(message.id)
            case CollisionObject.MOVE:
                if there is None:
                    raise scenes.SceneError(f"there is no object '{message.id}' to move")
                if any(pieces_of(message)):
                    raise scenes.SceneError(f"'{message.id}' is moved, so the message has no shapes")
                link = message.header.frame_id or self.scene.body.root
                self.scene.put(scenes.settled(replace(there, link=link, pose=pose_of(message.pose)), self.scene.body))
            case unknown:
                raise scenes.SceneError(f"there is no operation {unknown}")

    def attach(self, message: AttachedCollisionObject, poses: Poses) -> None:
        """Attach an object of the scene, or a new one, to a link; or detach one, without a name all of the link."""
        name = message.object.id
        if message.object.operation == CollisionObject.REMOVE:
            link = message.link_name
            held = [one for one in self.scene.objects.values() if self.scene.is_held(one) and link in ("", one.link)]
            for object_ in held:
                if name in ("", object_.name):
                    self.scene.detach(object_.name, poses)
            if name and not any(one.name == name for one in held):
                raise scenes.SceneError(f"no link holds '{name}'")
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
            raise scenes.SceneError(f"the link '{scaled[0]}' cannot be scaled: it can be padded")
        for padding in message.link_padding:
            self._pad(padding)
        for object_ in message.world.collision_objects:
            self.change(object_)
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
        held = [object_ for object_ in objects if self.scene.is_held(object_)]
        state = RobotState(
            joint_state=JointState(name=tuple(positions), position=np.array([*positions.values()])),
            attached_collision_objects=tuple(
                AttachedCollisionObject(link_name=item.link, object=collision_object(item), touch_links=item.touches)
                for item in held
            ),
        )
        return PlanningSceneMessage(
            name=name,
            robot_model_name=self.scene.body.name,
            robot_state=state,
            link_padding=tuple(LinkPadding(link_name=link, padding=padding) for link, padding in self.paddings.items()),
            object_colors=tuple(
                ObjectColor(id=item.name, color=colour_message(item.colour)) for item in objects if item.colour
            ),
            world=PlanningSceneWorld(
                collision_objects=tuple(collision_object(object_) for object_ in objects if object_ not in held)
            ),
        )

    def _placed(self, message: CollisionObject) -> scenes.PlacedObject:
        """Return the object of a message; a link that never moves does not hold it."""
        return scenes.settled(object_of(message, self.scene.body.root), self.scene.body)

    def _extended(self, there: scenes.PlacedObject, message: CollisionObject) -> scenes.PlacedObject:
        """Return an object with further shapes; those of the message may be in another frame or at another pose.

        The object stays where it is, and so do the shapes.
        """
        new = self._placed(message)
        if new.link != there.link:
            raise scenes.SceneError(f"'{there.name}' is in the frame of '{there.link}', and so are its further shapes")
        moved = there.pose.inverse().compose(new.pose)
        added = (scenes.ScenePiece(piece.shape, moved.compose(piece.pose)) for piece in new.own_pieces)
        return replace(there, pieces=(*there.pieces, *added))

    def _pad(self, padding: LinkPadding) -> None:
        if padding.link_name not in self.scene.body.links:
            raise scenes.SceneError(f"there is no link '{padding.link_name}'")
        if not 0.0 <= padding.padding <= 1.0:
            raise scenes.SceneError(f"the padding of '{padding.link_name}' is {padding.padding:g} m: from 0 to 1 m")
        self.paddings[padding.link_name] = padding.padding

    def _put_octomap(self, message: OctomapWithPose) -> None:
        tree = message.octomap
        if not tree.binary or tree.id != "OcTree":
            raise scenes.SceneError("an octomap is taken as a binary OcTree alone")
        try:
            cells = cells_of_octomap(tree.data.tobytes(), tree.resolution)
        except ValueError as error:
            raise scenes.SceneError(f"the octomap cannot be read: {error}") from error
        shape = Geometry("octree", (tree.resolution,), points=tuple(cells.flatten().tolist()))
        link = message.header.frame_id or self.scene.body.root
        self.scene.put(
            scenes.settled(scenes.PlacedObject(OCTOMAP, shape, link, pose_of(message.origin)), self.scene.body)
        )

    def _colour(self, message: ObjectColor) -> None:
        if (object_ := self.scene.objects.get(message.id)) is None:
            raise scenes.SceneError(f"there is no object '{message.id}' to colour")
        color = message.color
        self.scene.put(replace(object_, colour=(color.r, color.g, color.b, color.a)))

    def _allow(self, matrix: AllowedCollisionMatrix) -> None:
        """Let objects touch what the matrix says; its pairs of links are those of the robot, which knows its own."""
        names = matrix.entry_names
        for name, row in zip(names, matrix.entry_values, strict=False):
            if (object_ := self.scene.objects.get(name)) is not None:
                allowed = [other for other, is_allowed in zip(names, row.enabled, strict=False) if is_allowed]
                links = tuple(other for other in allowed if other in self.scene.body.links)
                others = tuple(other for other in allowed if other in self.scene.objects and other != name)
                self.scene.put(replace(object_, touches=links, touches_objects=others))


CODES = {
    MotionReason.UNKNOWN_GOAL: Codes.INVALID_GOAL_CONSTRAINTS,
    MotionReason.UNKNOWN_START: Codes.ROBOT_STATE_STALE,
    MotionReason.UNKNOWN_SCENE: Codes.COLLISION_CHECKING_UNAVAILABLE,
    MotionReason.START_OUTSIDE_LIMITS: Codes.START_STATE_INVALID,
    MotionReason.START_IN_COLLISION: Codes.START_STATE_IN_COLLISION,
    MotionReason.GOAL_OUTSIDE_LIMITS: Codes.GOAL_STATE_INVALID,
    MotionReason.GOAL_IN_COLLISION: Codes.GOAL_IN_COLLISION,
    MotionReason.GOAL_OUT_OF_REACH: Codes.NO_IK_SOLUTION,
    MotionReason.NO_PATH_IN_TIME: Codes.TIMED_OUT,
    MotionReason.PATH_IN_COLLISION: Codes.INVALID_MOTION_PLAN,
    MotionReason.NOT_KEPT: Codes.PLANNING_FAILED,
    MotionReason.PATH_INCOMPLETE: Codes.PLANNING_FAILED,
    MotionReason.NO_TIMING: Codes.INVALID_MOTION_PLAN,
    MotionReason.START_MOVED: Codes.START_STATE_INVALID,
    MotionReason.NOT_FOLLOWED: Codes.CONTROL_FAILED,
    MotionReason.INTERRUPTED: Codes.PREEMPTED,
}
"""MoveIt's code for each reason; a motion that something comes into the way of has one more."""


def not_done(code: int, text: str) -> Codes:
    """Return why a request was not carried out."""
    return Codes(val=code, message=text, source="rbxcompose")


def code_of(failure: MotionFailure | None, *, is_moving: bool) -> Codes:
    """Return how a motion has ended; with `is_moving` it had begun."""
    if failure is None:
        return Codes(val=Codes.SUCCESS, source="rbxcompose")
    value = CODES[failure.reason]
    if is_moving and failure.reason is MotionReason.PATH_IN_COLLISION:
        value = Codes.MOTION_PLAN_INVALIDATED_BY_ENVIRONMENT_CHANGE
    return not_done(value, f"{failure.reason}: {failure.text}")


def trace_message(names: tuple[str, ...], times: list[float], rows: list[list[float]]) -> RobotTrajectory:
    """Return where joints were at some times."""
    points = tuple(
        JointTrajectoryPoint(positions=np.array(row), time_from_start=to_duration(time))
        for time, row in zip(times, rows, strict=True)
    )
    return RobotTrajectory(joint_trajectory=JointTrajectory(joint_names=names if points else (), points=points))


def trajectory_of(message: RobotTrajectory, names: tuple[str, ...], here: Array) -> Trajectory:
    """Return the motion of a message for joints that are `here`; those that it does not name stay there.

    A controller follows cubic curves, so that only positions and velocities of the points count. A motion that does
    not begin at the time 0 begins at rest, where the arm is.

    Raises:
        RequestError: if it is no motion of these joints.
    """
    joints, points = message.joint_trajectory.joint_names, message.joint_trajectory.points
    if message.multi_dof_joint_trajectory.points or not joints or not points:
        raise RequestError(Codes.INVALID_MOTION_PLAN, "the trajectory has no points of joints alone")
    if (unknown := [name for name in joints if name not in names]) or len(set(joints)) != len(joints):
        words = f"'{unknown[0]}' is no joint of this arm" if unknown else "a joint is named twice"
        raise RequestError(Codes.INVALID_MOTION_PLAN, words)
    if any(len(point.positions) != len(joints) or len(point.velocities) != len(joints) for point in points):
        raise RequestError(Codes.INVALID_MOTION_PLAN, "a point does not have a position and a velocity of each joint")
    columns = [names.index(name) for name in joints]
    times = np.array([to_seconds(point.time_from_start) for point in points])
    positions, velocities = np.tile(here, (len(points), 1)), np.zeros((len(points), len(names)))
    positions[:, columns] = [point.positions for point in points]
    velocities[:, columns] = [point.velocities for point in points]
    if times[0] > 0.0:
        times, positions = np.concatenate(([0.0], times)), np.concatenate((here[None], positions))
        velocities = np.concatenate((np.zeros((1, len(names))), velocities))
    numbers = (times, positions, velocities)
    if times[0] < 0.0 or np.any(np.diff(times) <= 0.0) or not all(np.all(np.isfinite(number)) for number in numbers):
        raise RequestError(Codes.INVALID_MOTION_PLAN, "the times of points do not increase, or a number is none")
    if velocities[0].any() or velocities[-1].any():
        raise RequestError(Codes.INVALID_MOTION_PLAN, "the motion does not begin and end at rest")
    return Trajectory(times, positions, velocities)


SceneAround = tuple[tuple[scenes.PlacedObject, ...], Mapping[str, float]]
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
        raise RequestError(Codes.FAILURE, f"'planning_scene_diff' has {words}, which is not taken")
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
    objects: Iterable[scenes.PlacedObject],
    paddings: Mapping[str, float],
    difference: PlanningSceneMessage,
    positions: Mapping[str, float],
) -> SceneAround:
    """Return what is around a body whose joints are at `positions` [rad or m] with a difference.

    Raises:
        RequestError: if it cannot be.
    """
    scene = MoveItScene(scenes.PlanningScene(body, objects), dict(paddings))
    try:
        scene.apply(difference, body.poses(positions))
    except scenes.SceneError as error:
        raise RequestError(Codes.INVALID_OBJECT_NAME, f"'planning_scene_diff' cannot be: {error}") from error
    return tuple(scene.scene.objects.values()), scene.paddings


MOST_SAMPLES = 20_000  # of a motion that was carried out
JointReadings = Mapping[str, tuple[float, float]]


class MoveItSite(ArmSite, Protocol):
    """What such a goal needs of the component that carries it out."""

    def show(self, names: tuple[str, ...], trajectory: Trajectory) -> None:
        """Tell viewers a motion."""


class MoveItTask:
    """One goal. Call `advance` until `is_over`; then `result` is how it ended.

    It is the site of the task that does the work. With `plan_only`, that finds its joints at `start` and has its
    trajectory noted instead of followed.
    """

    stage = ""

    def __init__(self, site: MoveItSite, planner: MotionPlanner) -> None:
        self._site, self._planner, self._own = site, planner, planner.settings
        self.difference: PlanningSceneMessage | None = None
        """By which the scene differs from that of the robot until it is over."""
        self._task: ArmTask | None = None
        self._refusal: Codes | None = None
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
    def code(self) -> Codes:
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
        motion = found.planned_trajectory
        if planned is not None:
            motion = RobotTrajectory(joint_trajectory=joint_trajectory(names, planned, begin=0))
        return MoveGroup.Result(
            error_code=self.code,
            trajectory_start=self._begin_state,
            planned_trajectory=motion,
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

    def report_stage(self, stage: str) -> None:
        """Report the stage."""
        self.stage = stage
        self._site.report_stage(stage)

    def info(self, text: str) -> None:
        """Log an event."""
        self._site.info(text)
