"""Positions of joints that bring the tip to a point while it keeps how it is turned and where it may be."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.collisions import Checker
from rbxcompose.motion.inverse_kinematics import CLOSER, ENOUGH, RESTARTS, PoseSolutions, PoseTarget
from rbxcompose.motion.joint_space import JointSpace
from rbxcompose.motion.kept import Keep, KeptTip
from rbxcompose.motion.pose_search import nearest_first
from rbxcompose.motion.posture import Posture

Array = NDArray[np.float64]


def kept_solutions(
    kinematics: ArmKinematics,
    space: JointSpace,
    target: PoseTarget,
    keep: Keep,
    start: Array,
    first: Array,
    checker: Checker,
    *,
    seed: int,
    posture: Posture | None = None,
) -> Generator[None, None, PoseSolutions]:
    """Return solutions as `solved` does, for a target of which only the position counts.

    With a posture, one of the attempts begins there, and the solutions nearest to it come first. What is kept is
    measured from positions `first`, where the whole motion began.
    """
    frame = kinematics.poses(first)[keep.frame].inverse() if keep.frame else None
    point = frame.apply(target.pose.translation) if frame is not None else target.pose.translation
    half = CLOSER * target.tolerance / math.sqrt(3.0)
    x, y, z = ((one - half, one + half) for one in point)
    kept = KeptTip(kinematics, keep, first, checker)
    there = KeptTip(kinematics, replace(keep, inside=(x, y, z)), first, checker)
    free: list[Array] = []
    colliding: list[Array] = []
    nearest, attempts = (math.inf, math.inf), 0
    guesses = (start,) if posture is None else (start, posture.guess(start))
    for guess in (*map(space.clamped, guesses), *space.samples(RESTARTS, seed)):
        attempts += 1
        values = there.projected(guess, space)
        if values is not None and kept.is_kept(values) and target.is_met(kinematics.tip_pose(values)):
            (free if checker.is_free(values) else colliding).append(values)
        elif (alone := kept.projected(guess, space)) is not None:
            nearest = min(nearest, target.error(kinematics.tip_pose(alone)))
        if len(free) >= ENOUGH + len(guesses) - 1:
            break
        yield
    by_distance = [sorted(one, key=lambda values: float(np.max(np.abs(values - start)))) for one in (free, colliding)]
    ordered = tuple(by_distance[0]) if posture is None else nearest_first(space, posture, by_distance[0])
    return PoseSolutions(ordered, tuple(by_distance[1]), nearest, attempts)
