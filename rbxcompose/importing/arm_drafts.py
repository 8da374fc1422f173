"""A manifest for a body that has nothing but its URDF: servos that are guessed, controllers, and arms."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field

from rbxcompose.body.model import Body, BodyJoint
from rbxcompose.body.srdf import OuterJoint
from rbxcompose.dataclass import dataclass
from rbxcompose.importing.manifest_text import Row, angle, flow, flow_list, key, length, row, section, word

MODEL = "MX-28"
"""The servo that is guessed: it sees a whole turn."""
_WIDEST = math.radians(179)  # [rad] that such a servo turns to each side
_TRAVEL = 1.1  # times the range of a joint that slides, which half a turn of its servo goes
_GUESS = "a guess"


@dataclass(frozen=True, slots=True)
class GripperDraft:
    """A gripper that one joint opens, from its lower limit to its upper one."""

    name: str
    joint: str


@dataclass(frozen=True, slots=True)
class ArmDraft:
    """An arm: `where` is its chain, its joints or its groups, as a manifest has them; `joints` are those it moves."""

    name: str
    where: str
    joints: tuple[str, ...]
    poses: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    passive: tuple[str, ...] = ()
    gripper: GripperDraft | None = None
    comment: str = ""


def manifest_of(
    body: Body, drafts: Sequence[ArmDraft], file: str, pairs: str = "", outer: OuterJoint | None = None
) -> str:
    """Return the sections of a robot with arms; `file` is the URDF, `pairs` that of the pairs of links, if any."""
    own = {"urdf": key(file)} | ({"collisions": key(pairs)} if pairs else {})
    if outer is not None:
        names = {"name": word(outer.name), "type": outer.kind, "frame": word(outer.frame)}
        own["virtual_joint"] = flow(names)
    grippers = {one.gripper.name: one.gripper for one in drafts if one.gripper is not None}
    joints = list(
        dict.fromkeys([*(joint for one in drafts for joint in one.joints), *(one.joint for one in grippers.values())])
    )
    parts = [
        [row(0, "body:"), *(row(1, f"{name}: {value}") for name, value in own.items())],
        [row(0, "buses:"), row(1, "servos: {type: dynamixel}")],
        [row(0, "actuators:"), *_actuators(joints)],
        [row(0, "joints:"), *(_joint(body.joints[joint]) for joint in joints)],
        [row(0, "controllers:"), *_controllers(body, drafts, grippers.values())],
        [row(0, "arms:"), *(line for one in drafts for line in _arm(body, one))],
    ]
    return "\n".join(section(part) for part in parts)


def _actuators(joints: Iterable[str]) -> Iterator[Row]:
    for number, joint in enumerate(joints, 1):
        entries = {"bus": "servos", "model": MODEL, "id": str(number)}
        yield row(1, f"{key(f'{joint}_servo')}: {flow(entries)}", _GUESS)


def _joint(one: BodyJoint) -> Row:
    entries = {"actuator": key(f"{one.name}_servo")}
    lower, upper = ends_of(one)
    if one.slides:
        entries["travel"] = length(round(2 * _TRAVEL * max(abs(lower), abs(upper), 1e-3), 4))
    elif max(-lower, upper) > _WIDEST or one.kind == "continuous":
        bounds = [f"{math.degrees(each):.1f} deg" for each in (max(lower, -_WIDEST), min(upper, _WIDEST))]
        entries["limits"] = flow({"position": flow_list(bounds)})
    return row(1, f"{key(one.name)}: {flow(entries)}", _GUESS if one.slides else "")


def ends_of(one: BodyJoint) -> tuple[float, float]:
    """Return the limits of a joint [rad or m]; half a turn to each side if it has none."""
    if one.limits is None or one.kind == "continuous":
        return -math.pi, math.pi
    lower, upper = one.limits.lower, one.limits.upper
    return (-math.pi if lower is None else lower), (math.pi if upper is None else upper)


def _controllers(body: Body, drafts: Iterable[ArmDraft], grippers: Iterable[GripperDraft]) -> Iterator[Row]:
    led = set[str]()
    for one in drafts:
        entries = {"type": "joint_trajectory", "joints": flow_list([key(joint) for joint in one.joints])}
        if led & set(one.joints):
            entries["start"] = "inactive"
        led.update(one.joints)
        yield row(1, f"{one.name}_controller: {flow(entries)}")
    for gripper in grippers:
        joint = body.joints[gripper.joint]
        lower, upper = ends_of(joint)
        span = 2 * (upper - lower) if joint.slides else 0.08
        ends = ((0.0, lower), (span, upper))
        points = flow_list([flow({"opening": length(round(gap, 4)), "angle": angle(at)}) for gap, at in ends])
        entries = {"type": "gripper", "model": "calibrated", "joint": key(gripper.joint), "calibration": points}
        yield row(1, f"{gripper.name}_controller: {flow(entries)}", _GUESS)


def _arm(body: Body, one: ArmDraft) -> Iterator[Row]:
    yield row(1, f"{one.name}:", one.comment)
    yield row(2, one.where)
    if one.passive:
        yield row(2, f"passive: {flow_list([key(joint) for joint in one.passive])}")
    yield row(2, f"controller: {one.name}_controller")
    if one.gripper is not None:
        yield row(2, f"gripper: {one.gripper.name}_controller")
    if one.poses:
        yield row(2, "poses:")
    for pose, positions in one.poses.items():
        shown = {key(joint): _position(body.joints[joint], value) for joint, value in positions.items()}
        yield row(3, f"{key(pose)}: {flow(shown)}")


def _position(joint: BodyJoint, value: float) -> str:
    return length(value) if joint.slides else angle(value)
