"""A manifest for a body that has nothing but its URDF: servos, controllers and arms that are guessed."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from itertools import takewhile

from rbxcompose.base.dataclass import dataclass
from rbxcompose.commands.importing.foreign_files import FreeNames
from rbxcompose.commands.importing.manifest_text import Row, angle, flow, flow_list, key, length, row, section, word
from rbxcompose.compiler.composition.robot_file import is_own_name
from rbxcompose.domains.body.model import Body, BodyJoint
from rbxcompose.domains.body.srdf import OuterJoint

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
    """Return the sections of a robot with arms; `file` is URDF or xacro, `pairs` that of the pairs of links, if any."""
    own = {"xacro" if file.endswith(".xacro") else "urdf": key(file)} | ({"collisions": key(pairs)} if pairs else {})
    if outer is not None:
        names = {"name": word(outer.name), "type": outer.kind, "frame": word(outer.frame)}
        own["virtual_joint"] = flow(names)
    grippers = {draft.gripper.name: draft.gripper for draft in drafts if draft.gripper is not None}
    joints = list(
        dict.fromkeys(
            [*(joint for draft in drafts for joint in draft.joints), *(gripper.joint for gripper in grippers.values())]
        )
    )
    parts = [
        [row(0, "body:"), *(row(1, f"{name}: {value}") for name, value in own.items())],
        [row(0, "buses:"), row(1, "servos: {type: dynamixel}")],
        [row(0, "actuators:"), *_actuators(joints)],
        [row(0, "joints:"), *(_joint(body.joints[joint]) for joint in joints)],
        [row(0, "controllers:"), *_controllers(body, drafts, grippers.values())],
        [row(0, "arms:"), *(line for draft in drafts for line in _arm(body, draft))],
    ]
    return "\n".join(section(part) for part in parts)


def _actuators(joints: Iterable[str]) -> Iterator[Row]:
    for number, joint in enumerate(joints, 1):
        entries = {"bus": "servos", "model": MODEL, "id": str(number)}
        yield row(1, f"{key(f'{joint}_servo')}: {flow(entries)}", _GUESS)


def _joint(joint: BodyJoint) -> Row:
    entries = {"actuator": key(f"{joint.name}_servo")}
    lower, upper = ends_of(joint)
    if joint.slides:
        entries["travel"] = length(round(2 * _TRAVEL * max(abs(lower), abs(upper), 1e-3), 4))
    elif max(-lower, upper) > _WIDEST or joint.kind == "continuous":
        bounds = [f"{math.degrees(each):.1f} deg" for each in (max(lower, -_WIDEST), min(upper, _WIDEST))]
        entries["limits"] = flow({"position": flow_list(bounds)})
    return row(1, f"{key(joint.name)}: {flow(entries)}", _GUESS if len(entries) > 1 else "")


def ends_of(joint: BodyJoint) -> tuple[float, float]:
    """Return the limits of a joint [rad or m]; half a turn to each side if it has none."""
    if joint.limits is None or joint.kind == "continuous":
        return -math.pi, math.pi
    lower, upper = joint.limits.lower, joint.limits.upper
    return (-math.pi if lower is None else lower), (math.pi if upper is None else upper)


def _controllers(body: Body, drafts: Iterable[ArmDraft], grippers: Iterable[GripperDraft]) -> Iterator[Row]:
    led = set[str]()
    for draft in drafts:
        entries = {"type": "joint_trajectory", "joints": flow_list([key(joint) for joint in draft.joints])}
        if led & set(draft.joints):
            entries["start"] = "inactive"
        led.update(draft.joints)
        yield row(1, f"{draft.name}_controller: {flow(entries)}")
    for gripper in grippers:
        joint = body.joints[gripper.joint]
        lower, upper = ends_of(joint)
        entries = {"type": "gripper", "model": "sliding" if joint.slides else "calibrated", "joint": key(gripper.joint)}
        if joint.slides:
            entries["opening"] = flow_list([length(round(2 * at, 4)) for at in (lower, upper)])
        else:
            ends = ((0.0, lower), (0.08, upper))
            points = [flow({"opening": length(gap), "angle": angle(at)}) for gap, at in ends]
            entries["calibration"] = flow_list(points)
        yield row(1, f"{gripper.name}_controller: {flow(entries)}", _GUESS)


def _arm(body: Body, draft: ArmDraft) -> Iterator[Row]:
    yield row(1, f"{draft.name}:", draft.comment)
    yield row(2, draft.where)
    if draft.passive:
        yield row(2, f"passive: {flow_list([key(joint) for joint in draft.passive])}")
    yield row(2, f"controller: {draft.name}_controller")
    if draft.gripper is not None:
        yield row(2, f"gripper: {draft.gripper.name}_controller")
    if draft.poses:
        yield row(2, "poses:")
    for pose, positions in draft.poses.items():
        shown = {key(joint): _position(body.joints[joint], value) for joint, value in positions.items()}
        yield row(3, f"{key(pose)}: {flow(shown)}")


def _position(joint: BodyJoint, value: float) -> str:
    if joint.slides:
        return length(value)
    return angle(math.remainder(value, math.tau) if joint.kind == "continuous" else value)


LEAST, LONG = 2, 4  # joints of an arm: wheels have one; a long row is an arm even if it carries a hand of many joints
SHORT = 0.15  # [m] that a finger slides at most
_FINGER = re.compile(r"finger|gripper|claw|jaw|thumb", re.IGNORECASE)
_TOOL = re.compile(r"grasp|tool|tcp|tip|end_?effector|ee_link", re.IGNORECASE)


def proposed_arms(body: Body) -> list[ArmDraft]:
    """Return the arms of a body: rows of joints from where it branches to a hand, or to an end."""
    return list(_Proposals(body).drafts())


class _Proposals:
    def __init__(self, body: Body) -> None:
        self.body, self.names = body, FreeNames(is_own_name)
        self.below: dict[str, list[BodyJoint]] = {"": []}  # moving joints by the one that carries them
        for joint in body.joints_downwards:
            if joint.moves:
                self.below[joint.name] = []
                self.below[self._carrier(joint.parent)].append(joint)

    def drafts(self) -> Iterator[ArmDraft]:
        """Yield the arms."""
        for last, fingers in self.below.items():
            if not last or self._is_finger(self.body.joints[last]):
                continue
            row = self._row(last)
            joints = tuple(joint.name for joint in row if joint.mimic is None)
            is_end = not fingers or self._is_hand(fingers) or (len(fingers) > 1 and len(joints) >= LONG)
            if is_end and len(joints) >= LEAST:
                where = f"chain: {flow({'from': key(row[0].parent), 'to': key(self._tip(row[-1], fingers))})}"
                name = self.names.take(_common(joints), "arm")
                poses = {"resting": {joint: self.body.joints[joint].rest for joint in joints}}
                yield ArmDraft(name, where, joints, poses, gripper=self._gripper(name, fingers))

    def _carrier(self, link: str) -> str:
        return next((joint.name for joint in self.body.joints_above(link) if joint.moves), "")

    def _row(self, last: str) -> list[BodyJoint]:
        """Return the joints from where the body branches to the last one; wheels of the body are no branch."""
        found = [self.body.joints[last]]
        while (above := self._carrier(found[0].parent)) and len(self.below[above]) == 1:
            found.insert(0, self.body.joints[above])
        return found

    def _is_hand(self, joints: list[BodyJoint]) -> bool:
        return bool(joints) and all(map(self._is_finger, joints))

    def _is_finger(self, joint: BodyJoint) -> bool:
        """Return whether a joint is that of a finger: others follow it, it slides a little, or it is called so."""
        if self.below[joint.name]:
            return False
        lower, upper = ends_of(joint)
        is_followed = any(
            each.mimic is not None and each.mimic.joint == joint.name for each in self.body.joints.values()
        )
        slides_little = joint.slides and upper - lower <= SHORT
        return joint.mimic is not None or is_followed or slides_little or bool(_FINGER.search(joint.name))

    def _tip(self, last: BodyJoint, fingers: list[BodyJoint]) -> str:
        """Return the frame of a tool that the last joint carries, else the palm, else its link."""
        fixed = [last.child]
        for link in fixed:
            fixed += [joint.child for joint in self.body.joints_below[link] if not joint.moves]
        tools = [link for link in fixed if _TOOL.search(link)]
        return tools[-1] if tools else fingers[0].parent if fingers else last.child

    def _gripper(self, arm: str, fingers: list[BodyJoint]) -> GripperDraft | None:
        own = [finger.name for finger in fingers if finger.mimic is None and self._is_hand(fingers)]
        return GripperDraft(self.names.take(f"{arm}_gripper", "gripper"), own[0]) if len(own) == 1 else None


def _common(names: Iterable[str]) -> str:
    """Return what all names begin with, without a number or the word 'joint' at its end."""
    columns = zip(*names, strict=False)
    found = "".join(column[0] for column in takewhile(lambda column: len(set(column)) == 1, columns))
    return found.rstrip("_-0123456789").removesuffix("joint").rstrip("_-")
