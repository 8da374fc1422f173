"""What MoveIt reads of a robot: its URDF, and an SRDF with its arms and the pairs of links to ignore."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.body.description import Description
from rbxcompose.body.model import Body
from rbxcompose.body.srdf import EndEffector, OuterJoint, SemanticGroup, Semantics, to_srdf
from rbxcompose.manifest.section import Contents
from rbxcompose.sections.arms import ArmOfRobot, arms
from rbxcompose.sections.body import body
from rbxcompose.sections.controllers import controllers

_CONTROLLER = "_controller"  # ends the names of controllers, and not those of groups


def exported(contents: Contents, name: str) -> dict[str, str]:
    """Return the files for MoveIt by name; nothing if the robot has no body."""
    description = contents.of(body)
    if description is None:
        return {}
    return {
        f"{name}.urdf": description.published,
        f"{name}.srdf": to_srdf(semantics_of(contents, description.body.name)),
    }


def semantics_of(contents: Contents, name: str) -> Semantics:
    """Return what is known of the arms of a robot; `name` is that of its body."""
    description, found = contents.of(body), contents.of(arms)
    hands: dict[str, SemanticGroup] = {}
    effectors: list[EndEffector] = []
    for arm, one in found.items():
        there = contents.of(controllers).get(one.model.gripper or "")
        if there is not None and description is not None:
            hand = (one.model.gripper or "").removesuffix(_CONTROLLER)
            hands[hand] = SemanticGroup(hand, joints=tuple(there.claimed))
            effectors.append(EndEffector(hand, hand, _palm(description.body, there.claimed[0]), arm))
    return Semantics(
        name,
        {**{arm: _group(arm, one, description) for arm, one in found.items()}, **hands},
        {arm: poses for arm, one in found.items() if (poses := _poses(one))},
        tuple(effectors),
        tuple(dict.fromkeys(joint for one in found.values() for joint in one.model.passive)),
        description.matrix.pairs if description is not None and description.matrix is not None else {},
        tuple(_outer(description)) if description is not None else (),
    )


def _outer(known: Description) -> Iterator[OuterJoint]:
    if one := known.virtual:
        yield OuterJoint(one.name, one.kind, one.frame, known.body.own_root)


def _group(name: str, one: ArmOfRobot, known: Description | None) -> SemanticGroup:
    chain, body = one.model.chain, known.body if known is not None else Body("")
    top = body.own_root if body.frame else ""
    chains = ((top if chain.from_ == body.frame else chain.from_, chain.to),) if chain is not None else ()
    return SemanticGroup(name, chains, tuple(one.model.joints), tuple(one.model.links), tuple(one.model.groups))


def _poses(one: ArmOfRobot) -> dict[str, dict[str, float]]:
    return {pose: {joint: at.value for joint, at in written.items()} for pose, written in one.model.poses.items()}


def _palm(known: Body, joint: str) -> str:
    """Return the link that carries a finger."""
    return known.joints[joint].parent
