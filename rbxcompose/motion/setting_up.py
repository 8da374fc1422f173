"""A checker of collisions for an arm, with the pairs that it need not watch."""

from __future__ import annotations

import atexit
import gc
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from rbxcompose.body.link_pairs import LinkPair
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.collisions import MeshChecker, adjacent_pairs
from rbxcompose.motion.joint_space import JointSpace
from rbxcompose.motion.matrix import SAMPLES, SEED, unavoidable_pairs
from rbxcompose.motion.parametrisation import toppra


def load_libraries() -> None:
    """Import what planning needs, which takes seconds and should not delay the first goal.

    Raises:
        ModuleNotFoundError: if the extra `arm` is not installed.
    """
    atexit.unregister(gc.freeze)  # without a last collection at the exit, OMPL prints all that it had
    import_module("ompl.geometric")
    toppra()


def always_colliding(
    kinematics: ArmKinematics, space: JointSpace, meshes: Mapping[str, Path]
) -> tuple[frozenset[LinkPair], frozenset[LinkPair]]:
    """Return the links that a joint connects, and further pairs that collide wherever the arm is.

    Raises:
        ValueError: if a mesh cannot be read.
    """
    adjacent = adjacent_pairs(kinematics.body)
    checker = MeshChecker(kinematics, meshes, adjacent)
    return adjacent, unavoidable_pairs(space.samples(SAMPLES, SEED), checker.colliding)
