"""The links that an arm moves, as arrays, and where they are, computed by compiled code."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.model import Body
from rbxcompose.geometry import Transform3, Vector3, rotate
from rbxcompose.motion.groups import ArmGroup, leader_of
from rbxcompose.motion.numba_cache import compiled

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
ChainRow = tuple[int, int, Transform3, Vector3, int, float, float]  # of a `Chain`

FIXED, TURNS, SLIDES = 0, 1, 2
UPWARDS: Vector3 = (0.0, 0.0, 1.0)


class Chain(NamedTuple):
    """Frames of links, each after the one that carries it; arrays have an entry for each of them.

    A joint is at `multipliers * q[joints] + offsets` [rad or m]; `q` are positions of the arm's joints, of shape (n,).
    """

    parents: Indices
    """The frame that carries it, -1 for the root."""
    kinds: Indices
    """FIXED, TURNS or SLIDES."""
    places: Array
    """Its frame in that of its parent at position 0, of shape (m, 3, 4): the rotation, then the translation [m]."""
    axes: Array
    """Unit vectors in its own frame, of shape (m, 3)."""
    joints: Indices
    multipliers: Array
    offsets: Array


def chain_of(
    body: Body, group: ArmGroup, positions: Mapping[str, float], links: Collection[str]
) -> tuple[Chain, Mapping[str, int]]:
    """Return the frames of some links, with those that the arm moves on the way to them, and the index of each.

    Joints that the arm does not move are where `positions` [rad or m] put them, or at rest. Frames that nothing moves
    relative to their parents are left out, if they are not in `links`.
    """
    wanted, needed = set(links), set[str]()
    for link in links:
        while link not in needed and (above := body.joint_above.get(link)) is not None:
            needed.add(link)
            link = above.parent
    rows: list[ChainRow] = []
    known, carried = {}, {body.root: (-1, Transform3())}  # the frame that carries a link, and where the link is in it
    if body.root in wanted:
        known[body.root] = 0
        rows.append((-1, FIXED, Transform3(), UPWARDS, 0, 0.0, 0.0))
        carried[body.root] = (0, Transform3())
    for joint in body.joints_downwards:
        if joint.child not in needed:
            continue
        parent, place = carried[joint.parent]
        leader, multiplier, offset = leader_of(joint, body.joints)
        if joint.moves and leader in group.joints:
            kind, place = SLIDES if joint.slides else TURNS, place.compose(joint.origin)
            row = (parent, kind, place, joint.axis, group.joints.index(leader), multiplier, offset)
        else:
            at = joint.at(body.position(joint, positions)) if joint.moves else joint.origin
            row = (parent, FIXED, place.compose(at), UPWARDS, 0, 0.0, 0.0)
            if joint.child not in wanted:
                carried[joint.child] = (parent, row[2])
                continue
        known[joint.child] = len(rows)
        carried[joint.child] = (len(rows), Transform3())
        rows.append(row)
    return _arrays(rows), known


def matrix_of(pose: Transform3) -> Array:
    """Return a pose as its rotation and translation [m] beside each other, of shape (3, 4)."""
    axes = [rotate(pose.rotation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    return np.ascontiguousarray(np.array([*axes, pose.translation]).T)


def _arrays(rows: list[ChainRow]) -> Chain:
    parents, kinds, places, axes, joints, multipliers, offsets = zip(*rows, strict=True) if rows else ((),) * 7
    return Chain(
        np.array(parents, dtype=np.int64),
        np.array(kinds, dtype=np.int64),
        np.array([matrix_of(one) for one in places]).reshape(-1, 3, 4),
        np.array(axes, dtype=float).reshape(-1, 3),
        np.array(joints, dtype=np.int64),
        np.array(multipliers, dtype=float),
        np.array(offsets, dtype=float),
    )


@compiled
def link_frames(chain: Chain, q: Array) -> Array:
    """Return the frames of a chain in that of the root, of shape (m, 3, 4), at positions of shape (n,)."""
    frames = np.empty((len(chain.parents), 3, 4))
    place_links(chain, q, frames)
    return frames


@compiled
def place_links(chain: Chain, q: Array, frames: Array) -> None:
    """Write the frames of a chain in that of the root, at positions of shape (n,), into an array of shape (m, 3, 4)."""
    own = np.empty((3, 4))  # in the frame of the parent
    for index in range(len(chain.parents)):
        place, kind = chain.places[index], chain.kinds[index]
        x, y, z = chain.axes[index, 0], chain.axes[index, 1], chain.axes[index, 2]
        at = chain.multipliers[index] * q[chain.joints[index]] + chain.offsets[index] if kind != FIXED else 0.0
        if kind == TURNS:
            _turn(place, x, y, z, at, own)
        else:
            _copy(place, own)
            if kind == SLIDES:
                for row in range(3):
                    own[row, 3] += at * (place[row, 0] * x + place[row, 1] * y + place[row, 2] * z)
        parent = chain.parents[index]
        if parent < 0:
            _copy(own, frames[index])
        else:
            _compose(frames[parent], own, frames[index])


@compiled
def _turn(place: Array, x: float, y: float, z: float, angle: float, out: Array) -> None:
    """Write a frame that is turned about one of its axes: Rodrigues' formula."""
    cos, sin = math.cos(angle), math.sin(angle)
    rest = 1.0 - cos
    for row in range(3):
        a, b, c = place[row, 0], place[row, 1], place[row, 2]
        out[row, 0] = a * (cos + rest * x * x) + b * (rest * x * y + sin * z) + c * (rest * x * z - sin * y)
        out[row, 1] = a * (rest * x * y - sin * z) + b * (cos + rest * y * y) + c * (rest * y * z + sin * x)
        out[row, 2] = a * (rest * x * z + sin * y) + b * (rest * y * z - sin * x) + c * (cos + rest * z * z)
        out[row, 3] = place[row, 3]


@compiled
def _copy(frame: Array, out: Array) -> None:
    for row in range(3):
        for column in range(4):
            out[row, column] = frame[row, column]


@compiled
def _compose(first: Array, second: Array, out: Array) -> None:
    for row in range(3):
        a, b, c = first[row, 0], first[row, 1], first[row, 2]
        for column in range(4):
            out[row, column] = a * second[0, column] + b * second[1, column] + c * second[2, column]
        out[row, 3] += first[row, 3]
