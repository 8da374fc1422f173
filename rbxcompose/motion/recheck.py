"""The last examination of a motion, of the very curves that the controller follows."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from rbxcompose.control.trajectory_plan import ROUNDING
from rbxcompose.dataclass import dataclass
from rbxcompose.motion.collisions import Checker, SearchingChecker, told
from rbxcompose.motion.joint_space import JointSpace

Array = NDArray[np.float64]
SLICE = 1_000  # examined positions, after which an examination lets others run


@dataclass(frozen=True, slots=True)
class Rejected:
    """What is wrong with a motion, and how far along it, from 0 to 1."""

    is_collision: bool
    text: str
    share: float


def examined(points: Array, space: JointSpace, checker: Checker) -> Generator[None, None, Rejected | None]:
    """Examine points of shape (m, n); return what is wrong with the first bad one."""
    beyond = np.any((points < space.lower - ROUNDING) | (points > space.upper + ROUNDING), axis=1)
    beyond |= ~np.all(np.isfinite(points), axis=1)
    inside = points[: np.argmax(beyond)] if np.any(beyond) else points
    for begin in range(0, len(inside), SLICE):
        bad = first_bad(checker, inside[begin : begin + SLICE])
        if bad is not None:
            return Rejected(True, told(checker.colliding(inside[begin + bad])), (begin + bad) / len(points))
        yield
    if len(inside) < len(points):
        return Rejected(False, space.outside(points[len(inside)], ROUNDING), len(inside) / len(points))
    return None


def first_bad(checker: Checker, points: Array) -> int | None:
    """Return the first of some points, of shape (m, n), where something collides; None if there is none."""
    if isinstance(checker, SearchingChecker):
        return checker.first_bad(points)
    return next((index for index, values in enumerate(points) if not checker.is_free(values)), None)
