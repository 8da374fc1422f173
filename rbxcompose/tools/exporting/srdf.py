"""What MoveIt reads of a robot: its URDF, an SRDF with its arms and the pairs of links to ignore, limits of joints."""

from collections.abc import Iterator, Sequence

import yaml

from rbxcompose.domains.arms.motion.groups import moved_links
from rbxcompose.domains.arms.sections.arms import ArmOfRobot, arms
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.body.srdf import EndEffector, OuterJoint, SemanticGroup, Semantics, to_srdf
from rbxcompose.domains.servos.sections.controllers import controllers
from rbxcompose.domains.servos.sections.joints import held_limits, joints
from rbxcompose.manifest.section import Contents

_CONTROLLER = "_controller"  # ends the names of controllers, and not those of groups


def exported(contents: Contents, name: str) -> dict[str, str]:
    """Return the files for MoveIt by name; nothing if the robot has no body."""
    description = contents.of(body)
    if description is None:
        return {}
    limits = dict(_limits(contents, description.body))
    return {
        f"{name}.urdf": description.published,
        f"{name}.srdf": to_srdf(semantics_of(contents, description.body.name)),
        "joint_limits.yaml": yaml.safe_dump({"joint_limits": limits}, sort_keys=False),
    }


def _limits(contents: Contents, known: Body) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield the joints that are driven with their limits, which are tighter than those of the URDF."""
    for name, driven in contents.of(joints).items():
        limits = held_limits(driven, known.joints.get(name))
        found = {"min_position": limits.lower, "max_position": limits.upper, "max_velocity": limits.velocity}
        found |= {"max_acceleration": limits.acceleration, "max_jerk": limits.jerk}
        written = {key: value for key, value in found.items() if value is not None}
        yield name, {f"has_{key[4:]}_limits": True for key in written} | written


def semantics_of(contents: Contents, name: str) -> Semantics:
    """Return what is known of the arms of a robot; `name` is that of its body."""
    description, found = contents.of(body), contents.of(arms)
    hands: dict[str, SemanticGroup] = {}
    effectors: list[EndEffector] = []
    for arm, one in found.items():
        there = contents.of(controllers).get(one.model.gripper or "")
        if there is not None and description is not None:
            hand = (one.model.gripper or "").removesuffix(_CONTROLLER)
            carrier, links = _ends(description.body, one.group.tip, there.claimed)
            hands[hand] = SemanticGroup(hand, joints=tuple(there.claimed), links=links)
            effectors.append(EndEffector(hand, hand, carrier, arm))
    return Semantics(
        name,
        {**{arm: _group(arm, entry, description) for arm, entry in found.items()}, **hands},
        {arm: poses for arm, entry in found.items() if (poses := _poses(entry))},
        tuple(effectors),
        tuple(dict.fromkeys(joint for entry in found.values() for joint in entry.model.passive)),
        description.matrix.pairs if description is not None and description.matrix is not None else {},
        tuple(_outer(description)) if description is not None else (),
    )


def _outer(known: Description) -> Iterator[OuterJoint]:
    if joint := known.virtual:
        yield OuterJoint(joint.name, joint.kind, joint.frame, known.body.own_root)


def _group(name: str, robot: ArmOfRobot, known: Description | None) -> SemanticGroup:
    chain, body = robot.model.chain, known.body if known is not None else Body("")
    top = body.own_root if body.frame else ""
    chains = ((top if chain.from_ == body.frame else chain.from_, chain.to),) if chain is not None else ()
    return SemanticGroup(name, chains, tuple(robot.model.joints), tuple(robot.model.links), tuple(robot.model.groups))


def _poses(robot: ArmOfRobot) -> dict[str, dict[str, float]]:
    return {pose: {joint: at.value for joint, at in written.items()} for pose, written in robot.model.poses.items()}


def _ends(known: Body, tip: str, fingers: Sequence[str]) -> tuple[str, tuple[str, ...]]:
    """Return the link of an arm that carries its gripper, and the links of the gripper, with those between."""
    own = {joint.child for joint in known.joints_above(tip)}
    carrier = known.joints[fingers[0]].parent
    links = [link for link, joints in moved_links(known, fingers).items() if joints]
    while carrier not in own and carrier in known.joint_above:
        links.insert(0, carrier)
        carrier = known.joint_above[carrier].parent
    return carrier, tuple(links)
