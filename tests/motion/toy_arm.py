"""An arm of three joints beside a wall, all of spheres and boxes, so that other code can tell what is free."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import MeshChecker, adjacent_pairs
from rbxcompose.domains.arms.motion.groups import ArmJoint, JointSpace, chain
from rbxcompose.domains.arms.motion.planner import MotionPlanner, PlannerSettings
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.servos.limits import MotionLimits
from tests.body.kinematics import description_of

Array = NDArray[np.float64]
T = TypeVar("T")
Y = TypeVar("Y")
WALL = (0.02, 0.02, 0.5)
"""Half lengths of a wall at x = 0.45 m, from the ground up to 0.5 m; a fence is as wide as the arm reaches."""
FENCE = (0.6, 0.02, 2.0)
RADIUS = 0.04


def _link(name: str) -> str:
    balls = "".join(
        f'<collision><origin xyz="{x} 0 0"/><geometry><sphere radius="{RADIUS}"/></geometry></collision>'
        for x in (0.1, 0.16, 0.22, 0.28)
    )
    return f'<link name="{name}">{balls}</link>'


def _joint(name: str, parent: str, child: str, axis: str, at: str, limits: str) -> str:
    return f"""<joint name="{name}" type="revolute"><origin xyz="{at}"/><parent link="{parent}"/><child link="{child}"/>
    <axis xyz="{axis}"/><limit {limits} effort="1" velocity="2"/></joint>"""


def urdf(wall: tuple[float, float, float] = WALL) -> str:
    """Return the arm: it turns about z, and lifts and bends about y."""
    size = " ".join(str(2 * value) for value in wall)
    return f"""<robot name="toy">
  <link name="ground"><collision><origin xyz="0.45 0 {wall[2]}"/><geometry><box size="{size}"/></geometry></collision>
  </link>
  <link name="turret"/>{_link("upper")}{_link("fore")}<link name="tip"/>
  {_joint("turn", "ground", "turret", "0 0 1", "0 0 0.3", 'lower="-2" upper="2"')}
  {_joint("lift", "turret", "upper", "0 -1 0", "0 0 0", 'lower="-0.3" upper="1.5"')}
  {_joint("bend", "upper", "fore", "0 1 0", "0.3 0 0", 'lower="-1.2" upper="2.4"')}
  <joint name="end" type="fixed"><origin xyz="0.3 0 0"/><parent link="fore"/><child link="tip"/></joint>
</robot>"""


def kinematics(wall: tuple[float, float, float] = WALL) -> ArmKinematics:
    """Return the arm in Pinocchio."""
    description = description_of(urdf(wall))
    group = chain(description.body, "ground", "tip")
    assert group is not None
    return ArmKinematics(description, group)


def planner(wall: tuple[float, float, float] = WALL, **settings: object) -> MotionPlanner:
    """Return a planner for the arm, for which no time passes."""
    arm = kinematics(wall)
    joints = tuple(ArmJoint(name, _limits(arm.body, name)) for name in arm.group.joints)
    checker = MeshChecker(arm, {}, adjacent_pairs(arm.body))
    return MotionPlanner(JointSpace(joints), checker, PlannerSettings(**settings), lambda: 0.0)  # type: ignore[arg-type]


def fast_planner(
    wall: tuple[float, float, float] = WALL, things: Iterable[PlacedObject] = (), **settings: object
) -> MotionPlanner:
    """Return the same on the fast path."""
    from rbxcompose.domains.arms.motion.sphere_checker import (
        SphereChecker,  # which imports numba
        Trees,
    )

    made = planner(wall, **settings)
    arm = kinematics(wall)
    checker = SphereChecker(MeshChecker(arm, {}, adjacent_pairs(arm.body), things), Trees())
    checker.prepare(made.space)
    made.checker = checker
    return made


def compile_all() -> None:
    """Compile what tests call of compiled code, or read what was compiled before."""
    from rbxcompose.domains.arms.motion.compiled_collisions import chain_of, link_frames
    from tests.motion.test_compiled_convex import compile_gap

    arm = kinematics()
    arm.hasten()
    fast_planner()
    link_frames(chain_of(arm.body, arm.group, {}, ("tip",))[0], np.zeros(len(arm.group.joints)))
    compile_gap()


def _limits(body: Body, name: str) -> MotionLimits:
    limits = body.joints[name].limits
    assert limits is not None
    return MotionLimits(limits.lower, limits.upper, limits.velocity, 4.0)


def gap(body: Body, values: Array, wall: tuple[float, float, float] = WALL) -> float:
    """Return the least distance of the arm from the wall [m], by our own kinematics and a formula."""
    poses = body.poses(dict(zip(("turn", "lift", "bend"), values.tolist(), strict=True)))
    return min(
        _outside_box(poses[link].compose(shape.origin), wall) - RADIUS
        for link in ("upper", "fore")
        for shape in body.links[link].collisions
    )


def _outside_box(pose: Transform3, half: tuple[float, float, float]) -> float:
    beyond = np.abs(np.array(pose.translation) - (0.45, 0.0, half[2])) - half
    return float(np.linalg.norm(np.maximum(beyond, 0.0)) + min(float(np.max(beyond)), 0.0))


def ended(generator: Generator[Y, None, T], most: int = 10_000) -> T:
    """Return what a generator returns."""
    for _ in range(most):
        try:
            next(generator)
        except StopIteration as end:
            result: T = end.value
            return result
    raise AssertionError("it does not end")
