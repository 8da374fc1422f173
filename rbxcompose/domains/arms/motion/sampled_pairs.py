"""Which pairs of links of a whole body collide, by random positions of all its joints, on its shapes as they are."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import MeshChecker, adjacent_pairs
from rbxcompose.domains.arms.motion.groups import ArmGroup, ArmJoint, JointSpace
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.link_pairs import CollisionMatrix, LinkPair, PairReason, digest_of
from rbxcompose.domains.body.model import Body, BodyJoint
from rbxcompose.domains.servos.limits import MotionLimits

AT_ONCE = 100  # positions after which it lets others run


def sampled_matrix(description: Description, samples: int, seed: int) -> Generator[int, None, CollisionMatrix]:
    """Return the matrix of a body; yield how many positions were tried.

    Joints have the limits of the URDF, which are the widest; those without limits go half a turn each way. The same
    seed gives the same matrix. What no joint moves is known without trying.

    Raises:
        ModuleNotFoundError: if the extra `arm` is not installed.
        ValueError: if a mesh cannot be read.
    """
    body = description.body
    space = whole_space(body)
    kinematics = ArmKinematics(description, ArmGroup(space.names, body.root, body.root))
    rest = np.array([body.joints[name].rest for name in space.names])
    rigid = MeshChecker(kinematics, description.meshes, is_rigid=True)
    every = MeshChecker(kinematics, description.meshes)
    pairs = every.watched_pairs
    there = rigid.watched_pairs | pairs
    adjacent = adjacent_pairs(body) & there
    touching = frozenset(rigid.colliding(rest))
    at_rest = frozenset(every.colliding(rest)) - adjacent
    always, colliding = set(at_rest), set(at_rest)
    unseen, lasting = every.without(adjacent | colliding), every.without(pairs - always)
    for count, values in enumerate(space.samples(samples, seed), 1):
        if not unseen.is_free(values):
            colliding.update(unseen.colliding(values))
            unseen = every.without(adjacent | colliding)
        if always and len(still := always.intersection(lasting.colliding(values))) < len(always):
            always = still
            lasting = every.without(pairs - always)
        if count % AT_ONCE == 0:
            yield count
    reasons: dict[LinkPair, PairReason] = dict.fromkeys(there - colliding - touching, "never")
    reasons.update(dict.fromkeys(at_rest, "default"))
    reasons.update(dict.fromkeys(always | touching, "always"))
    reasons.update(dict.fromkeys(adjacent, "adjacent"))
    return CollisionMatrix(reasons, samples, seed, digest_of(body, description.meshes))


def whole_space(body: Body) -> JointSpace:
    """Return all joints of a body that have positions of their own, with the limits of the URDF."""
    return JointSpace(tuple(map(_whole_joint, body.moving)))


def _whole_joint(joint: BodyJoint) -> ArmJoint:
    if joint.limits is None or joint.kind == "continuous":
        return ArmJoint(joint.name, MotionLimits(), is_continuous=True, slides=joint.slides)
    return ArmJoint(joint.name, MotionLimits(joint.limits.lower, joint.limits.upper), slides=joint.slides)
