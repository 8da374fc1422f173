"""An arm: joints of the body, from a base to a tip; what can be wrong with them; the positions they may have."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.body.model import Body, BodyJoint
from rbxcompose.domains.servos.limits import MotionLimits


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
    return ArmGroup(tuple(joint.name for joint in found), found[0].parent, found[-1].child)


def carrying(body: Body, links: Sequence[str]) -> ArmGroup | None:
    """Return the joints of links, without those that are fixed or mimic; None if none of them carries the last link.

    The last link is the tip.
    """
    above = [body.joint_above[link] for link in links if link in body.joint_above]
    if not (joints := [joint.name for joint in above if joint.moves and joint.mimic is None]):
        return None
    found = group_of(body, joints)
    is_carried = found.joints[-1] in moved_links(body, found.joints)[links[-1]]
    return ArmGroup(found.joints, found.base, links[-1]) if is_carried else None


def together(body: Body, parts: Sequence[ArmGroup]) -> ArmGroup:
    """Return the joints of several arms as one, in the order of the body; its tip is that of the last one."""
    whole = group_of(body, (joint for part in parts for joint in part.joints))
    first = way_up(body, ArmGroup(whole.joints, whole.base, parts[-1].tip))[-1].name
    return ArmGroup(whole.joints, next(part.base for part in parts if first in part.joints), parts[-1].tip)


def way_up(body: Body, group: ArmGroup) -> list[BodyJoint]:
    """Return all joints from the tip up to the last of the arm's own above it; the others are on branches beside it."""
    above = list(body.joints_above(group.tip))
    return above[: max(index for index, joint in enumerate(above) if joint.name in group.joints) + 1]


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


def solid_link(body: Body, link: str) -> str:
    """Return the link whose shapes are around a frame: itself, or the one that a frame without shapes is fixed to."""
    while not body.links[link].collisions and link in body.joint_above and not body.joint_above[link].moves:
        link = body.joint_above[link].parent
    return link


def leader_of(joint: BodyJoint, joints: Mapping[str, BodyJoint]) -> tuple[str, float, float]:
    """Return the joint that a joint mimics at last, itself if none, with the multiplier and the offset of all."""
    multiplier, offset = 1.0, 0.0
    while (mimic := joint.mimic) is not None:
        multiplier, offset = multiplier * mimic.multiplier, multiplier * mimic.offset + offset
        joint = joints[mimic.joint]
    return joint.name, multiplier, offset


UNLIMITED = math.pi
"""[rad], how far from 0 positions of joints without an end are sampled."""


@dataclass(frozen=True, slots=True)
class ArmJoint:
    """A joint of an arm; without an end if it is continuous."""

    name: str
    limits: MotionLimits
    is_continuous: bool = False
    slides: bool = False

    def shown(self, position: float) -> str:
        """Return a position for people."""
        return f"{position * 100:.1f} cm" if self.slides else f"{math.degrees(position):.1f} deg"


@dataclass(frozen=True)
class JointSpace:
    """The joints of an arm. All arrays of positions have the shape (n,), in [rad] or [m]; nobody changes limits."""

    joints: tuple[ArmJoint, ...]

    def inside(self, spare: float) -> JointSpace:
        """Return the space whose joints stay away from their limits by `spare` [rad or m], if there is room for it."""
        return JointSpace(tuple(_inside(joint, spare) for joint in self.joints))

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the joints."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def lower(self) -> Array:
        """Return the least positions; -inf without a limit."""
        return np.array([-math.inf if joint.is_continuous else joint.limits.least for joint in self.joints])

    @cached_property
    def upper(self) -> Array:
        """Return the greatest positions; inf without a limit."""
        return np.array([math.inf if joint.is_continuous else joint.limits.greatest for joint in self.joints])

    def outside(self, values: Array, tolerance: float = 0.0) -> str:
        """Return which joints are outside of their limits, in words; nothing if none is."""
        return "; ".join(self._outside(values, tolerance))

    def _outside(self, values: Array, tolerance: float) -> list[str]:
        found = []
        for joint, value in zip(self.joints, values.tolist(), strict=True):
            if not math.isfinite(value):
                found.append(f"'{joint.name}' at {value} is at no position")
            elif not joint.is_continuous and abs(joint.limits.clamped(value) - value) > tolerance:
                ends = (joint.limits.lower, joint.limits.upper)
                bounds = " to ".join("any" if end is None else joint.shown(end) for end in ends)
                found.append(f"'{joint.name}' at {joint.shown(value)} is beyond {bounds}")
        return found

    def clamped(self, values: Array) -> Array:
        """Return the nearest positions within the limits."""
        return np.clip(values, self.lower, self.upper)

    def nearest_turns(self, values: Array, reference: Array) -> Array:
        """Return the same positions, those of joints without an end at most half a turn from `reference`."""
        turning = np.array([joint.is_continuous for joint in self.joints])
        turns = np.round((reference - values) / math.tau) * math.tau
        return np.asarray(values + np.where(turning, turns, 0.0))

    def samples(self, count: int, seed: int) -> Array:
        """Return random positions within the limits, of shape (count, n)."""
        low = np.where(np.isfinite(self.lower), self.lower, -UNLIMITED)
        high = np.where(np.isfinite(self.upper), self.upper, UNLIMITED)
        return np.random.default_rng(seed).uniform(low, high, (count, len(self.joints)))


def interpolated(waypoints: Sequence[Array] | Array, step: float) -> Array:
    """Return points on the straight lines between waypoints, at most `step` [rad or m] apart in each joint."""
    found = [np.asarray(waypoints[0])[None]]
    for first, second in pairwise(waypoints):
        count = max(1, math.ceil(float(np.max(np.abs(second - first))) / step))
        found.append(first + (second - first) * (np.arange(1, count + 1) / count)[:, None])
    return np.concatenate(found)


def _inside(joint: ArmJoint, spare: float) -> ArmJoint:
    limits = joint.limits
    if joint.is_continuous or limits.greatest - limits.least < 4 * spare:
        return joint
    lower = None if limits.lower is None else limits.lower + spare
    upper = None if limits.upper is None else limits.upper - spare
    return replace(joint, limits=replace(limits, lower=lower, upper=upper))
