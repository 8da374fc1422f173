"""A checker of collisions for an arm, with the pairs that it need not watch."""

from __future__ import annotations

import atexit
import gc
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.collisions import LinkPair, MeshChecker, adjacent_pairs
from rbxcompose.motion.joint_space import JointSpace
from rbxcompose.motion.matrix import SAMPLES, SEED, unavoidable_pairs


def load_libraries() -> None:
    """Import what planning needs, which takes seconds and should not delay the first goal.

    Raises:
        ModuleNotFoundError: if the extra `arm` is not installed.
    """
    atexit.unregister(gc.freeze)  # without a last collection at the exit, OMPL prints all that it had
    import_module("ompl.geometric")
    import_module("toppra.algorithm")


def made_checker(
    kinematics: ArmKinematics, space: JointSpace, meshes: Mapping[str, Path]
) -> tuple[MeshChecker, frozenset[LinkPair]]:
    """Return a checker, and the pairs of links that it does not watch because they always collide.

    Raises:
        ValueError: if a mesh cannot be read.
    """
    adjacent = adjacent_pairs(kinematics.body)
    checker = MeshChecker(kinematics, meshes, adjacent)
    always = unavoidable_pairs(space.samples(SAMPLES, SEED), checker.colliding)
    return (MeshChecker(kinematics, meshes, adjacent | always) if always else checker), always
