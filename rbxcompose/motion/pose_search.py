"""Inverse kinematics as goals ask for it: exact where that is possible, near the posture that is preferred."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.inverse_kinematics import ENOUGH, RESTARTS, PoseSolutions, PoseTarget, solved
from rbxcompose.motion.joint_space import JointSpace
from rbxcompose.motion.nearest_poses import nearest_poses
from rbxcompose.motion.posture import Posture, slid

Array = NDArray[np.float64]

APART = 0.05  # [rad or m] by which a joint of another solution is elsewhere


def searched(
    kinematics: ArmKinematics,
    space: JointSpace,
    target: PoseTarget,
    start: Array,
    is_free: Callable[[Array], bool],
    *,
    seed: int,
    posture: Posture | None = None,
    restarts: int = RESTARTS,
    enough: int = ENOUGH,
    is_late: Callable[[], bool] = lambda: False,
) -> Generator[None, None, PoseSolutions]:
    """Return solutions as `solved` does, those nearest to a posture first if there is one.

    Each free one is brought as near to the posture as its tip stays at the target. It never ends farther from the
    posture than a search without it, since that one's attempts are among its own. If nothing free meets the target and
    that is approximate, the solutions are the nearest ones; the posture does not count then.
    """
    guesses = () if posture is None else (posture.guess(start),)
    found = yield from solved(
        kinematics,
        space,
        target,
        start,
        is_free,
        seed=seed,
        restarts=restarts,
        enough=enough + len(guesses),
        is_late=is_late,
        guesses=guesses,
    )
    if not found.free and target.is_approximate:
        near = yield from nearest_poses(
            kinematics, space, target, start, is_free, seed=seed, guesses=(*guesses, *found.colliding), is_late=is_late
        )
        exact = tuple(one for one in near if target.is_met(kinematics.tip_pose(one)))  # which restarts have missed
        found = replace(found, free=_apart(exact or near)[:enough], is_approximate=bool(near) and not exact)
    if posture is None or found.is_approximate:
        return found
    free = []
    for one in found.free:
        free.append(slid(kinematics, space, target, one, posture, is_free))
        yield
    return replace(found, free=_apart(nearest_first(space, posture, free)))


def nearest_first(space: JointSpace, posture: Posture, solutions: Iterable[Array]) -> tuple[Array, ...]:
    """Return solutions, those nearest to a posture first."""
    return tuple(sorted(solutions, key=lambda values: posture.distance(space, values)))


def _apart(solutions: Iterable[Array]) -> tuple[Array, ...]:
    """Return them without those that have come to where another one is: a way that one has not, that has not either."""
    found: list[Array] = []
    for one in solutions:
        if all(float(np.abs(one - other).max()) > APART for other in found):
            found.append(one)
    return tuple(found)
