"""A body whose arm moves, in Pinocchio: from the positions of the arm's joints to its `q`."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.description import Description
from rbxcompose.body.model import BodyJoint
from rbxcompose.body.pinocchio_model import PinocchioModel
from rbxcompose.dataclass import dataclass
from rbxcompose.motion.groups import ArmGroup

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Entry:
    """Where a joint of the arm, or one that mimics it, stands in `q`: `multiplier * values[index] + offset`."""

    place: int
    index: int
    multiplier: float
    offset: float
    turns: bool


class ArmKinematics:
    """A body of which an arm moves, while its other joints stay where `place` puts them."""

    def __init__(self, description: Description, group: ArmGroup) -> None:
        """Build it; raises as `PinocchioModel` does."""
        self.whole = PinocchioModel(description)
        self.body, self.group = description.body, group
        self._entries = [entry for name in self.whole.places if (entry := self._entry(name)) is not None]
        self._base = self.whole.q({})

    def place(self, positions: Mapping[str, float]) -> None:
        """Set where all other joints are [rad or m]; one that is not in `positions` is at rest."""
        self._base = self.whole.q(positions)

    def q(self, values: Array) -> Array:
        """Return the configuration for positions of the arm's joints, of shape (n,)."""
        found = self._base.copy()
        for entry in self._entries:
            position = entry.multiplier * values[entry.index] + entry.offset
            if entry.turns:
                found[entry.place], found[entry.place + 1] = math.cos(position), math.sin(position)
            else:
                found[entry.place] = position
        return found

    def _entry(self, name: str) -> _Entry | None:
        joint = self.body.joints[name]
        leader, multiplier, offset = _leader(joint, self.body.joints)
        if leader not in self.group.joints:
            return None
        index = self.group.joints.index(leader)
        return _Entry(self.whole.places[name], index, multiplier, offset, joint.kind == "continuous")


def _leader(joint: BodyJoint, joints: Mapping[str, BodyJoint]) -> tuple[str, float, float]:
    """Return the joint that a joint mimics at last, itself if none, with the multiplier and the offset of all."""
    multiplier, offset = 1.0, 0.0
    while (mimic := joint.mimic) is not None:
        multiplier, offset = multiplier * mimic.multiplier, multiplier * mimic.offset + offset
        joint = joints[mimic.joint]
    return joint.name, multiplier, offset
