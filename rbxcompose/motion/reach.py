"""Where the tip of an arm gets, cell by cell: from how many directions, or how well it moves there.

Random positions of the joints are tried, so what is told as reached is reached, and there may be more. The share of
directions is the reachability index of Zacharias, Borst, Hirzinger, Capturing Robot Workspace Structure: Representing
Robot Capabilities (2007). The manipulability is that of Yoshikawa, Manipulability of Robotic Mechanisms (1985):
sqrt(det(J J^T)), here with the rows of J for the translation of the tip, so that it has a unit, [m^3/rad^3] for joints
that turn. The greatest one of a cell counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.collisions import Checker
from rbxcompose.motion.joint_space import JointSpace

Array = NDArray[np.float64]
Cell = tuple[int, int, int]

DIRECTIONS = 50
SLICE = 2_000  # positions, after which others may run
SEEDS = 1_000_003  # between those of slices, so that no two of a person share positions
_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # [rad]


@dataclass(frozen=True, slots=True)
class Cut:
    """A layer of cells: those that have `at` [m] along the axis 0, 1 or 2 of the root's frame."""

    axis: int
    at: float


@dataclass(slots=True)
class ReachedCell:
    """What was found of a cell."""

    values: Array
    """Positions of joints that bring the tip there, of shape (n,): those of the greatest manipulability."""
    manipulability: float
    directions: set[int] = field(default_factory=set)
    """Which of the directions the x axis of the tip has had, by their numbers."""


@dataclass(frozen=True, slots=True)
class ReachMap:
    """Cells by their numbers along x, y and z: cubes of `side` [m], whose middles are at the numbers times that."""

    cells: Mapping[Cell, ReachedCell]
    side: float
    tried: int
    """Positions of joints, also those whose tip is not in the cut."""
    colliding: int

    def cell_of(self, point: Array) -> Cell:
        """Return the cell of a point [m] in the root's frame."""
        return _cell(point, self.side)


def reached(
    kinematics: ArmKinematics,
    space: JointSpace,
    checker: Checker,
    *,
    side: float,
    samples: int,
    seed: int,
    cut: Cut | None = None,
) -> Iterator[ReachMap]:
    """Yield the cells that the tip gets to at random positions that collide with nothing, more and more of them.

    The same seed tries the same positions. `side` [m] is that of a cell; with a cut, only its cells count.
    """
    cells, sphere = dict[Cell, ReachedCell](), directions()
    tried = colliding = 0
    wanted = None if cut is None else round(cut.at / side)
    for number in range(math.ceil(samples / SLICE)):
        batch = space.samples(min(SLICE, samples - tried), seed * SEEDS + number)
        for values in batch:
            position, rotation, _ = kinematics.tip(values, with_jacobian=False)
            cell = _cell(position, side)
            if cut is not None and cell[cut.axis] != wanted:
                continue
            if not checker.is_free(values):
                colliding += 1
                continue
            ease = manipulability(kinematics, values)
            known = cells.get(cell)
            if known is None:
                known = cells[cell] = ReachedCell(values, ease)
            elif ease > known.manipulability:
                known.values, known.manipulability = values, ease
            known.directions.add(int(np.argmax(sphere @ rotation[:, 0])))
        tried += len(batch)
        yield ReachMap(cells, side, tried, colliding)


def manipulability(kinematics: ArmKinematics, values: Array) -> float:
    """Return how well the tip moves: the volume that velocities of joints of length 1 make, but for a factor."""
    rows = kinematics.tip(values, with_jacobian=True)[2][:3]
    return math.sqrt(max(0.0, float(np.linalg.det(rows @ rows.T))))


def directions(count: int = DIRECTIONS) -> Array:
    """Return even directions, of shape (count, 3), on a spiral of the golden angle around z."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn, across = _GOLDEN * np.arange(count), np.sqrt(1.0 - z * z)
    return np.stack((across * np.cos(turn), across * np.sin(turn), z), axis=1)


def _cell(point: Array, side: float) -> Cell:
    x, y, z = np.round(point / side).astype(int).tolist()
    return x, y, z
