"""The last examination of a motion, of the very curves that the controller follows."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.collisions import Checker, told
from rbxcompose.motion.joint_space import JointSpace

Array = NDArray[np.float64]
SLICE = 1_000  # examined positions, after which an examination lets others run
ROUNDING = 1e-6  # [rad or m] beyond a limit


@dataclass(frozen=True, slots=True)
class Rejected:
    """What is wrong with a motion, and how far along it, from 0 to 1."""

    is_collision: bool
    text: str
    share: float


def examined(points: Array, space: JointSpace, checker: Checker) -> Generator[int, None, Rejected | None]:
    """Examine points of shape (m, n); return what is wrong with the first bad one. Yield how many were examined."""
    beyond = np.any((points < space.lower - ROUNDING) | (points > space.upper + ROUNDING), axis=1)
    for index, values in enumerate(points):
        if beyond[index] or not np.all(np.isfinite(values)):
            return Rejected(False, space.outside(values, ROUNDING), index / len(points))
        if not checker.is_free(values):
            return Rejected(True, told(checker.colliding(values)), index / len(points))
        if index % SLICE == SLICE - 1:
            yield index + 1
    return None
