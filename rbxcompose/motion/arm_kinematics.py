"""A body whose arm moves, in Pinocchio: from the positions of the arm's joints to its `q`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.description import Description
from rbxcompose.body.model import Body, BodyJoint
from rbxcompose.body.pinocchio_model import PinocchioModel
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3
from rbxcompose.motion.groups import ArmGroup

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Entry:
    """Where a joint of the arm, or one that mimics it, stands in `q` and `v`: `multiplier * values[index] + offset`."""

    place: int
    column: int
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
        self._positions: Mapping[str, float] = {}
        self._base = self.whole.q({})
        self._tip = self.whole.frames[group.tip]
        self._way = _way(self.body, group.tip)
        columns = np.zeros((self.whole.model.nv, len(group.joints)))
        for entry in self._entries:
            columns[entry.column, entry.index] = entry.multiplier
        self._columns = columns
        """From velocities of the arm's joints to those of Pinocchio."""

    def place(self, positions: Mapping[str, float]) -> None:
        """Set where all other joints are [rad or m]; one that is not in `positions` is at rest."""
        self._positions, self._base = dict(positions), self.whole.q(positions)

    def tip_pose(self, values: Array) -> Transform3:
        """Return the frame of the tip in that of the root, by our own kinematics."""
        positions = {**self._positions, **dict(zip(self.group.joints, values.tolist(), strict=True))}
        found = Transform3()
        for joint in self._way:
            at = joint.at(self.body.position(joint, positions)) if joint.moves else joint.origin
            found = found.compose(at)
        return found

    def poses(self, values: Array) -> dict[str, Transform3]:
        """Return the frame of every link in that of the root, by our own kinematics."""
        arm = dict(zip(self.group.joints, values.tolist(), strict=True))
        return self.body.poses({**self._positions, **arm})

    def placement(self, pose: Transform3) -> Any:
        """Return a pose as Pinocchio takes it."""
        import pinocchio

        return pinocchio.XYZQUATToSE3(np.array((*pose.translation, *pose.rotation), dtype=float))

    def error(self, values: Array, wanted: Any) -> tuple[Array, Array]:
        """Return how far the tip is from where it is wanted, of shape (6,), and its Jacobian, of shape (6, n).

        Both are in the frame of the tip: three lengths [m], then three angles [rad].
        """
        import pinocchio

        model, data = self.whole.model, self.whole.data
        pinocchio.computeJointJacobians(model, data, self.q(values))  # which also refreshes where all joints are
        here = pinocchio.updateFramePlacement(model, data, self._tip)
        away = here.actInv(wanted)
        error = np.concatenate((away.translation, pinocchio.log3(away.rotation)))
        jacobian = pinocchio.getFrameJacobian(model, data, self._tip, pinocchio.LOCAL)
        return error, np.asarray(jacobian @ self._columns)

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
        column = self.whole.model.joints[self.whole.model.getJointId(name)].idx_v
        return _Entry(self.whole.places[name], column, index, multiplier, offset, joint.kind == "continuous")


def _way(body: Body, link: str) -> list[BodyJoint]:
    """Return the joints from the root to a link."""
    found: list[BodyJoint] = []
    while (above := body.joint_above.get(link)) is not None:
        found.append(above)
        link = above.parent
    return found[::-1]


def _leader(joint: BodyJoint, joints: Mapping[str, BodyJoint]) -> tuple[str, float, float]:
    """Return the joint that a joint mimics at last, itself if none, with the multiplier and the offset of all."""
    multiplier, offset = 1.0, 0.0
    while (mimic := joint.mimic) is not None:
        multiplier, offset = multiplier * mimic.multiplier, multiplier * mimic.offset + offset
        joint = joints[mimic.joint]
    return joint.name, multiplier, offset
