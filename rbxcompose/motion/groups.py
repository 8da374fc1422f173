"""An arm: joints of the body, from a base to a tip."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from rbxcompose.body.model import Body, BodyJoint
from rbxcompose.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class ArmGroup:
    """Joints that move together, in order from the base; `base` and `tip` are links."""

    joints: tuple[str, ...]
    base: str
    tip: str


def chain(body: Body, base: str, tip: str) -> ArmGroup | None:
    """Return the joints between two links that have positions of their own; None if the tip is not below the base."""
    found: list[str] = []
    link = tip
    while link != base:
        above = body.joint_above.get(link)
        if above is None:
            return None
        if above.moves and above.mimic is None:
            found.append(above.name)
        link = above.parent
    return ArmGroup(tuple(reversed(found)), base, tip)


def group_of(body: Body, joints: Iterable[str]) -> ArmGroup:
    """Return joints as an arm, in the order of the body; its base carries the first one, its tip is below the last."""
    wanted = set(joints)
    found = [joint for joint in body.joints_downwards if joint.name in wanted]
    return ArmGroup(tuple(one.name for one in found), found[0].parent, found[-1].child)


def carrying(body: Body, links: Sequence[str]) -> ArmGroup | None:
    """Return the joints of links, without those that are fixed or mimic; None if none of them carries the last link.

    The last link is the tip.
    """
    above = [body.joint_above[link] for link in links if link in body.joint_above]
    if not (joints := [one.name for one in above if one.moves and one.mimic is None]):
        return None
    found = group_of(body, joints)
    is_carried = found.joints[-1] in moved_links(body, found.joints)[links[-1]]
    return ArmGroup(found.joints, found.base, links[-1]) if is_carried else None


def together(body: Body, parts: Sequence[ArmGroup]) -> ArmGroup:
    """Return the joints of several arms as one, in the order of the body; its tip is that of the last one."""
    whole = group_of(body, (joint for part in parts for joint in part.joints))
    first = next(part.base for part in parts if whole.joints[0] in part.joints)
    return ArmGroup(whole.joints, first, parts[-1].tip)


def moved_links(body: Body, joints: Iterable[str]) -> dict[str, frozenset[str]]:
    """Return which of some joints move each link in the root's frame, also those that others mimic."""
    own = set(joints)
    found = {body.root: frozenset[str]()}
    for joint in body.joints_downwards:
        leader = joint
        while leader.mimic is not None:
            leader = body.joints[leader.mimic.joint]
        found[joint.child] = found[joint.parent] | ({joint.name} if joint.moves and leader.name in own else set())
    return found


def leader_of(joint: BodyJoint, joints: Mapping[str, BodyJoint]) -> tuple[str, float, float]:
    """Return the joint that a joint mimics at last, itself if none, with the multiplier and the offset of all."""
    multiplier, offset = 1.0, 0.0
    while (mimic := joint.mimic) is not None:
        multiplier, offset = multiplier * mimic.multiplier, multiplier * mimic.offset + offset
        joint = joints[mimic.joint]
    return joint.name, multiplier, offset
