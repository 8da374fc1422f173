"""Arms and grippers that a body seems to have, by its joints and their names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import takewhile

from rbxcompose.body.model import Body, BodyJoint
from rbxcompose.importing.arm_drafts import ArmDraft, GripperDraft, ends_of
from rbxcompose.importing.manifest_text import flow, key
from rbxcompose.importing.names import FreeNames

LEAST, LONG = 2, 4  # joints of an arm: wheels have one; a long row is an arm even if it carries a hand of many joints
SHORT = 0.15  # [m] that a finger slides at most
_FINGER = re.compile(r"finger|gripper|claw|jaw|thumb", re.IGNORECASE)
_TOOL = re.compile(r"grasp|tool|tcp|tip|end_?effector|ee_link", re.IGNORECASE)


def proposed_arms(body: Body) -> list[ArmDraft]:
    """Return the arms of a body: rows of joints from where it branches to a hand, or to an end."""
    return list(_Proposals(body).drafts())


class _Proposals:
    def __init__(self, body: Body) -> None:
        self.body, self.names = body, FreeNames()
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
            joints = tuple(one.name for one in row if one.mimic is None)
            is_end = not fingers or self._is_hand(fingers) or (len(fingers) > 1 and len(joints) >= LONG)
            if is_end and len(joints) >= LEAST:
                where = f"chain: {flow({'from': key(row[0].parent), 'to': key(self._tip(row[-1], fingers))})}"
                name = self.names.take(_common(joints), "arm")
                poses = {"resting": {joint: self.body.joints[joint].rest for joint in joints}}
                yield ArmDraft(name, where, joints, poses, gripper=self._gripper(name, fingers))

    def _carrier(self, link: str) -> str:
        while (above := self.body.joint_above.get(link)) is not None and not above.moves:
            link = above.parent
        return above.name if above is not None else ""

    def _row(self, last: str) -> list[BodyJoint]:
        """Return the joints from where the body branches to the last one; wheels of the body are no branch."""
        found = [self.body.joints[last]]
        while (above := self._carrier(found[0].parent)) and len(self.below[above]) == 1:
            found.insert(0, self.body.joints[above])
        return found

    def _is_hand(self, joints: list[BodyJoint]) -> bool:
        return bool(joints) and all(map(self._is_finger, joints))

    def _is_finger(self, one: BodyJoint) -> bool:
        """Return whether a joint is that of a finger: others follow it, it slides a little, or it is called so."""
        if self.below[one.name]:
            return False
        lower, upper = ends_of(one)
        is_followed = any(each.mimic is not None and each.mimic.joint == one.name for each in self.body.joints.values())
        slides_little = one.slides and upper - lower <= SHORT
        return one.mimic is not None or is_followed or slides_little or bool(_FINGER.search(one.name))

    def _tip(self, last: BodyJoint, fingers: list[BodyJoint]) -> str:
        """Return the frame of a tool that the last joint carries, else the palm, else its link."""
        fixed = [last.child]
        for link in fixed:
            fixed += [one.child for one in self.body.joints_below[link] if not one.moves]
        tools = [link for link in fixed if _TOOL.search(link)]
        return tools[-1] if tools else fingers[0].parent if fingers else last.child

    def _gripper(self, arm: str, fingers: list[BodyJoint]) -> GripperDraft | None:
        own = [one.name for one in fingers if one.mimic is None and self._is_hand(fingers)]
        return GripperDraft(self.names.take(f"{arm}_gripper", "gripper"), own[0]) if len(own) == 1 else None


def _common(names: Iterable[str]) -> str:
    """Return what all names begin with, without a number or the word 'joint' at its end."""
    columns = zip(*names, strict=False)
    found = "".join(column[0] for column in takewhile(lambda column: len(set(column)) == 1, columns))
    return found.rstrip("_-0123456789").removesuffix("joint").rstrip("_-")
