"""Inverse kinematics by damped least squares as compiled code: what `inverse_kinematics` does, in less time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rbxcompose.base.arrays import Array
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.compiled_collisions import FIXED, TURNS, Chain, chain_of, matrix_of, place_links
from rbxcompose.domains.arms.motion.damped_steps import DAMPING, LEAST_DAMPING, LONGEST, PATIENCE, PROGRESS
from rbxcompose.domains.arms.motion.groups import ArmGroup
from rbxcompose.domains.arms.motion.numba_cache import compiled, inlined
from rbxcompose.domains.body.model import Body


class Aim(NamedTuple):
    """Where the tip should be, and when that is near enough; arrays in the frame of the root."""

    wanted: Array
    """Of shape (3, 4): the rotation, then the translation [m]."""
    top: int
    """The first part of the error that counts, of three lengths and then three angles: 3 if any position will do."""
    end: int
    """The one behind the last: 3 if any orientation will do."""
    near: float
    """[m] at which a descent ends."""
    near_angle: float
    """[rad] likewise."""
    tolerance: float
    """[m] from which on no further descent is needed."""
    angle_tolerance: float
    """[rad] likewise."""
    lower: Array
    upper: Array


class CompiledTip:
    """The way from the root to the tip of an arm, for positions of the other joints [rad or m]."""

    def __init__(self, body: Body, group: ArmGroup, positions: Mapping[str, float]) -> None:
        self._chain, _ = chain_of(body, group, positions, (group.tip,))
        self._size = len(group.joints)

    def warm_up(self) -> None:
        """Have it compiled, or read what was compiled before."""
        values = np.zeros(self._size)
        self.descend(self.aim(Transform3(), (0, 6), (1.0, 4.0), (1.0, 4.0), (values, values)), values[None])

    def aim(
        self,
        pose: Transform3,
        rows: tuple[int, int],
        near: tuple[float, float],
        tolerances: tuple[float, float],
        bounds: tuple[Array, Array],
    ) -> Aim:
        """Return a pose in the root's frame as what to aim at."""
        x, y, z, w = pose.rotation
        size = math.hypot(x, y, z, w)
        unit = Transform3(pose.translation, (x / size, y / size, z / size, w / size))
        value, other, most, largest = (float(each) for each in (*near, *tolerances))  # a whole number is another type
        return Aim(matrix_of(unit), *rows, value, other, most, largest, *bounds)

    def descend(self, aim: Aim, firsts: Array) -> tuple[int, Array, Array]:
        """Descend from positions of shape (k, n), one after the other, until the tolerances are met.

        Return how many it began from, where the last one ended, of shape (n,), and how far from the aim each one ended
        [m, rad], of shape (k, 2).
        """
        values, away = np.empty(firsts.shape[1]), np.empty((len(firsts), 2))
        own = np.array(firsts, dtype=float)  # another layout, or one that is read-only, would be compiled anew
        return _descents(self._chain, aim, own, values, away), values, away


@compiled
def _descents(chain: Chain, aim: Aim, firsts: Array, values: Array, away: Array) -> int:
    size, joints = len(values), len(chain.parents)
    frames, jacobian = np.empty((joints, 3, 4)), np.empty((6, size))
    error, square, solution, step = np.empty(6), np.empty((6, 6)), np.empty(6), np.empty(size)
    for index in range(len(firsts)):
        for joint in range(size):
            values[joint] = firsts[index, joint]
        _descent(chain, aim, values, away[index], (frames, jacobian, error, square, solution, step))
        if away[index, 0] <= aim.tolerance and away[index, 1] <= aim.angle_tolerance:
            return index + 1
    return len(firsts)


@inlined
def _descent(
    chain: Chain, aim: Aim, values: Array, away: Array, work: tuple[Array, Array, Array, Array, Array, Array]
) -> None:
    """Change the values until the tip is near its aim, or they are stuck."""
    frames, jacobian, error, square, solution, step = work
    best, patience = math.inf, PATIENCE
    while True:
        place_links(chain, values, frames)
        _measure(frames[-1], aim.wanted, error)
        away[0] = math.sqrt(error[0] * error[0] + error[1] * error[1] + error[2] * error[2]) if aim.top == 0 else 0.0
        away[1] = math.sqrt(error[3] * error[3] + error[4] * error[4] + error[5] * error[5]) if aim.end == 6 else 0.0
        size = away[0] * away[0] + away[1] * away[1]
        patience = PATIENCE if size < PROGRESS * best else patience - 1
        best = min(best, size)
        if (away[0] <= aim.near and away[1] <= aim.near_angle) or patience <= 0:
            return
        _differentiate(chain, frames, jacobian)
        _step(jacobian, square, error, solution, aim, size, step)
        if _block(jacobian, aim, values, step):  # the others do the part of joints that cannot
            _step(jacobian, square, error, solution, aim, size, step)
        longest = LONGEST
        for joint in range(len(values)):
            longest = max(longest, abs(step[joint]))
        for joint in range(len(values)):
            moved = values[joint] + step[joint] * LONGEST / longest
            values[joint] = min(max(moved, aim.lower[joint]), aim.upper[joint])


@inlined
def _step(jacobian: Array, square: Array, error: Array, solution: Array, aim: Aim, size: float, step: Array) -> None:
    """Write the damped step; `size` is the square of the error."""
    top, rows = aim.top, aim.end - aim.top
    for row in range(rows):
        for column in range(row + 1):
            total = LEAST_DAMPING + DAMPING * size if row == column else 0.0
            for joint in range(len(step)):
                total += jacobian[top + row, joint] * jacobian[top + column, joint]
            square[row, column] = total
    _solve(square, error[top:], rows, solution)
    for joint in range(len(step)):
        step[joint] = 0.0
        for row in range(rows):
            step[joint] += jacobian[top + row, joint] * solution[row]


@inlined
def _block(jacobian: Array, aim: Aim, values: Array, step: Array) -> bool:
    """Take joints that would go beyond the limit at which they are from the Jacobian; return whether there are any."""
    found = False
    for joint in range(len(values)):
        if values[joint] <= aim.lower[joint] if step[joint] < 0.0 else values[joint] >= aim.upper[joint]:
            found = True
            for row in range(6):
                jacobian[row, joint] = 0.0
    return found


@inlined
def _measure(tip: Array, wanted: Array, error: Array) -> None:
    """Write how far the tip is from where it is wanted [m, rad], along the axes of the root.

    The angle is that of the turn between both: its vector is read from the skew part, near half a turn from the rest.
    """
    turn = np.empty((3, 3))  # wanted times the transpose of the tip's rotation
    for row in range(3):
        error[row] = wanted[row, 3] - tip[row, 3]
        for column in range(3):
            turn[row, column] = (
                wanted[row, 0] * tip[column, 0] + wanted[row, 1] * tip[column, 1] + wanted[row, 2] * tip[column, 2]
            )
    x, y, z = turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]
    sine, cosine = math.sqrt(x * x + y * y + z * z), turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0  # both twice
    angle = math.atan2(sine, cosine)
    if sine > 1e-6:
        share = angle / sine
        error[3], error[4], error[5] = share * x, share * y, share * z
    elif cosine > 0.0:
        error[3], error[4], error[5] = x / 2, y / 2, z / 2
    else:
        _half_turn(turn, angle, error)


@inlined
def _half_turn(turn: Array, angle: float, error: Array) -> None:
    largest = 0
    for row in range(1, 3):
        if turn[row, row] > turn[largest, largest]:
            largest = row
    length = 0.0
    for row in range(3):
        error[3 + row] = turn[row, largest] + (1.0 if row == largest else 0.0)
        length += error[3 + row] * error[3 + row]
    for row in range(3):
        error[3 + row] *= angle / math.sqrt(length)


@inlined
def _differentiate(chain: Chain, frames: Array, jacobian: Array) -> None:
    """Write the Jacobian of the last frame, along the axes of the root."""
    for row in range(6):
        for column in range(jacobian.shape[1]):
            jacobian[row, column] = 0.0
    tip = frames[len(frames) - 1]
    for index in range(len(chain.parents)):
        if chain.kinds[index] == FIXED:
            continue
        frame, joint, share = frames[index], chain.joints[index], chain.multipliers[index]
        u, v, w = chain.axes[index, 0], chain.axes[index, 1], chain.axes[index, 2]
        x = share * (frame[0, 0] * u + frame[0, 1] * v + frame[0, 2] * w)
        y = share * (frame[1, 0] * u + frame[1, 1] * v + frame[1, 2] * w)
        z = share * (frame[2, 0] * u + frame[2, 1] * v + frame[2, 2] * w)
        if chain.kinds[index] == TURNS:
            a, b, c = tip[0, 3] - frame[0, 3], tip[1, 3] - frame[1, 3], tip[2, 3] - frame[2, 3]
            jacobian[0, joint] += y * c - z * b
            jacobian[1, joint] += z * a - x * c
            jacobian[2, joint] += x * b - y * a
            jacobian[3, joint] += x
            jacobian[4, joint] += y
            jacobian[5, joint] += z
        else:
            jacobian[0, joint] += x
            jacobian[1, joint] += y
            jacobian[2, joint] += z


@inlined
def _solve(square: Array, right: Array, size: int, solution: Array) -> None:
    """Solve equations by Cholesky's decomposition; of the square, the lower half counts, and is overwritten."""
    for row in range(size):
        for column in range(row + 1):
            total = square[row, column]
            for inner in range(column):
                total -= square[row, inner] * square[column, inner]
            square[row, column] = math.sqrt(total) if row == column else total / square[column, column]
        total = right[row]
        for inner in range(row):
            total -= square[row, inner] * solution[inner]
        solution[row] = total / square[row, row]
    for row in range(size - 1, -1, -1):
        total = solution[row]
        for inner in range(row + 1, size):
            total -= square[inner, row] * solution[inner]
        solution[row] = total / square[row, row]
