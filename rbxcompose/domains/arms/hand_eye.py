"""Where a camera is, measured by a tag on the hand of an arm: from poses of the hand and of the tag, found together.

With the hand in the base A, the tag before the camera B, the camera in the base X and the tag on the hand Y, each pair
has A Y = X B. A first solution by M. Shah, Solving the Robot-World/Hand-Eye Calibration Problem Using the Kronecker
Product, 2013, is refined by least squares over positions and rotations. Lengths are in [m], angles in [rad].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, angle_between
from rbxcompose.domains.worlds.physics.solids import quaternion_of, rotation_matrix

Numbers = NDArray[np.float64]
LEAST = 3  # pairs
TURNED = math.radians(8)  # by which a hand turns about each of two axes, root mean square over all pairs of poses
PER_TURN = 0.2  # an error of 1 rad counts as one of so many metres
ROUNDS = 20
STEP = 1e-6  # of numeric slopes [m, rad]
APART = 0.02, math.radians(5)  # by one of which poses of a hand are other ones
STILL = 0.002, math.radians(0.3)  # within both of which a hand stands
STANDS, READINGS = 1.0, 5  # [s], and readings of the tag, of which a pair is the mean


class PoorMotionsError(ValueError):
    """Raised when a camera cannot be measured by the poses that there are, with the reason."""


@dataclass(frozen=True, slots=True)
class HandSight:
    """Where the hand was in the base, and the tag in the frame of the camera."""

    hand: Transform3
    tag: Transform3


@dataclass(frozen=True, slots=True)
class HandEye:
    """A camera that was measured."""

    camera: Transform3
    """In the base."""
    tag: Transform3
    """On the hand."""
    off: tuple[tuple[float, float], ...]
    """How far each pair is off [m] and by which angle [rad]."""
    known_to: tuple[float, float]
    """Standard deviation of the position and of the rotation of the camera, by what pairs are off."""

    @property
    def misses(self) -> tuple[float, float]:
        """Return how far pairs are off, root mean square [m] and [rad]."""
        away, angle = np.sqrt(np.mean(np.square(self.off), axis=0)).tolist()
        return away, angle


def measured(pairs: Sequence[HandSight]) -> HandEye:
    """Return the camera and the tag that explain pairs best.

    Raises:
        PoorMotionsError: if these are too few, or the hand has turned too little for it.
    """
    if len(pairs) < LEAST:
        raise PoorMotionsError(f"{len(pairs)} poses of the hand are too few: {LEAST} is the least, and 10 are good")
    hands = np.array([rotation_matrix(pair.hand.rotation) for pair in pairs])
    tags = np.array([rotation_matrix(pair.tag.rotation) for pair in pairs])
    _prove_turned(hands)
    hand_at = np.array([pair.hand.translation for pair in pairs])
    tag_at = np.array([pair.tag.translation for pair in pairs])
    left, _, right = np.linalg.svd(sum(np.kron(tag, hand) for hand, tag in zip(hands, tags, strict=True)))
    camera, tag = _rotation(left[:, 0]), _rotation(right[0])
    if np.trace(hands[0] @ tag @ tags[0].T @ camera.T) < 0:  # both vectors of the decomposition may be turned round
        camera = _rotation(-left[:, 0])
    rows = np.concatenate([np.hstack((np.eye(3), -hand)) for hand in hands])
    both, *_ = np.linalg.lstsq(rows, (hand_at - tag_at @ camera.T).ravel(), rcond=None)
    found: list[tuple[Numbers, Numbers]] = [(camera, np.asarray(both[:3], float)), (tag, np.asarray(both[3:], float))]

    def misses(change: Numbers) -> Numbers:
        (turn_x, at_x), (turn_y, at_y) = (_moved(*one, change[6 * n : 6 * n + 6]) for n, one in enumerate(found))
        away = hand_at + hands @ at_y - (at_x + tag_at @ turn_x.T)
        turned = np.swapaxes(turn_x @ tags, 1, 2) @ hands @ turn_y
        return np.column_stack((away, PER_TURN * np.array([_vector(one) for one in turned]))).ravel()

    for _ in range(ROUNDS):
        off = misses(np.zeros(12))
        slopes = np.column_stack([(misses(step) - off) / STEP for step in np.eye(12) * STEP])
        solved, *_ = np.linalg.lstsq(slopes, -off, rcond=None)
        change = np.asarray(solved, float)
        found = [_moved(*one, change[6 * n : 6 * n + 6]) for n, one in enumerate(found)]
        if np.abs(change).max() < 1e-9:
            break
    off = misses(np.zeros(12)).reshape(-1, 2, 3)
    spread = np.linalg.pinv(slopes.T @ slopes) * (off**2).sum() / max(1, off.size - 12)
    away, angles = np.linalg.norm(off, axis=2).T
    camera_pose, tag_pose = (Transform3(_three(at), quaternion_of(turn)) for turn, at in found)
    known_to = (math.sqrt(np.trace(spread[:3, :3])), math.sqrt(np.trace(spread[3:6, 3:6])))
    each = tuple(zip(away.tolist(), (angles / PER_TURN).tolist(), strict=True))
    return HandEye(camera_pose, tag_pose, each, known_to)


class StandingHand:
    """Takes a pair each time the hand stands somewhere else, as the mean of several readings."""

    def __init__(self) -> None:
        self.pairs: list[HandSight] = []
        self._readings: list[tuple[float, HandSight]] = []

    def take(self, now: float, reading: HandSight) -> bool:
        """Take one more reading at a time [s]; return whether it completes a pair."""
        if self._readings and not _is_within(reading.hand, self._readings[0][1].hand, STILL):
            self._readings.clear()
        if any(_is_within(reading.hand, pair.hand, APART) for pair in self.pairs):
            return False
        self._readings.append((now, reading))
        if now - self._readings[0][0] < STANDS or len(self._readings) < READINGS:
            return False
        hands, tags = ([getattr(one, name) for _, one in self._readings] for name in ("hand", "tag"))
        self.pairs.append(HandSight(_mean(hands), _mean(tags)))
        self._readings.clear()
        return True


def _prove_turned(hands: Numbers) -> None:
    """Raise an error unless hands with rotations (n, 3, 3) have turned enough, and about two axes."""
    turns = np.array([_vector(other @ one.T) for one, other in combinations(hands, 2)])
    _, second, most = np.sqrt(np.maximum(0.0, np.linalg.eigvalsh(turns.T @ turns / len(turns)))).tolist()
    if most < TURNED:
        raise PoorMotionsError(
            f"the hand has turned by {math.degrees(most):.0f} deg only: poses of it must differ by 30 deg and more"
        )
    if second < TURNED:
        raise PoorMotionsError(
            "the hand has turned about one axis only, which leaves open where along that the camera is: turn it about "
            "another one, too, by 30 deg and more"
        )


def _rotation(vector: Numbers) -> Numbers:
    """Return the rotation (3, 3) nearest to a matrix, given column by column and by some factor (9,)."""
    matrix = vector.reshape(3, 3).T
    matrix = matrix * np.sign(np.linalg.det(matrix))
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ right)


def _moved(turn: Numbers, at: Numbers, change: Numbers) -> tuple[Numbers, Numbers]:
    """Return a rotation (3, 3) and a position, changed by a translation and by a rotation about fixed axes (6,)."""
    x, y, z = change[3:]
    angle = float(np.linalg.norm(change[3:]))
    cross = np.array(((0, -z, y), (z, 0, -x), (-y, x, 0)))
    sine, versine = (math.sin(angle) / angle, (1 - math.cos(angle)) / angle**2) if angle > 1e-9 else (1.0, 0.5)
    return (np.eye(3) + sine * cross + versine * cross @ cross) @ turn, at + change[:3]


def _vector(turn: Numbers) -> Numbers:
    """Return a rotation (3, 3) as its axis times its angle (3,)."""
    x, y, z, w = quaternion_of(turn)
    sine = math.sqrt(x * x + y * y + z * z)
    angle = 2 * math.atan2(sine, w)
    angle = angle if angle <= math.pi else angle - math.tau
    return np.array((x, y, z)) * (angle / sine if sine > 1e-12 else 2.0)


def _is_within(one: Transform3, other: Transform3, bounds: tuple[float, float]) -> bool:
    away, angle = math.dist(one.translation, other.translation), angle_between(one.rotation, other.rotation)
    return away <= bounds[0] and angle <= bounds[1]


def _mean(poses: Sequence[Transform3]) -> Transform3:
    """Return the mean of poses that are nearly alike."""
    turns = np.array([pose.rotation for pose in poses])
    turns *= np.sign(turns @ turns[0])[:, None]
    x, y, z, w = (turns.sum(0) / np.linalg.norm(turns.sum(0))).tolist()
    return Transform3(_three(np.array([pose.translation for pose in poses]).mean(0)), (x, y, z, w))


def _three(vector: Numbers) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
