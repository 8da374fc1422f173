"""A body whose arm moves, in Pinocchio: from the positions of the arm's joints to its `q`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbxcompose.base.arrays import Array, Ints, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.groups import ArmGroup, leader_of
from rbxcompose.domains.arms.motion.numba_cache import is_installed
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.pinocchio_model import PinocchioModel


@dataclass(frozen=True, slots=True)
class _Entry:
    """Where a joint of the arm, or one that mimics it, stands in `q` and `v`: `multiplier * values[index] + offset`."""

    place: int
    column: int
    index: int
    multiplier: float
    offset: float
    turns: bool


def _arrays(entries: Sequence[_Entry]) -> tuple[Ints, Ints, Array, Array]:
    """Return places, indices, multipliers and offsets of several of them."""
    rows = np.array([(each.place, each.index, each.multiplier, each.offset) for each in entries], dtype=float)
    places, indices, multipliers, offsets = rows.reshape(-1, 4).T
    return places.astype(np.int64), indices.astype(np.int64), multipliers.copy(), offsets.copy()


class ArmKinematics:
    """A body of which an arm moves, while its other joints stay where `place` puts them."""

    def __init__(self, description: Description, group: ArmGroup) -> None:
        """Build it; raises as `PinocchioModel` does."""
        import pinocchio

        self._pinocchio: Any = pinocchio
        self.whole = PinocchioModel(description)
        self.body, self.group = description.body, group
        self._positions: Mapping[str, float] = {}
        self._base = self.whole.q({})
        self._tip = self.whole.frames[group.tip]
        self._way = list(self.body.joints_above(group.tip))[::-1]
        leaders = {leader_of(joint, self.body.joints)[0] for joint in self._way}
        self.moves_tip = np.array([name in leaders for name in group.joints])
        """Which joints of the arm move its tip, of shape (n,)."""
        entries = [entry for name in self.whole.places if (entry := self._entry(name)) is not None]
        self._entries = _arrays([one for one in entries if not one.turns])
        self._turning = _arrays([one for one in entries if one.turns])
        columns = np.zeros((self.whole.model.nv, len(group.joints)))
        for entry in entries:
            columns[entry.column, entry.index] = entry.multiplier
        self._columns = columns
        """From velocities of the arm's joints to those of Pinocchio."""
        self._is_hastened = False
        self._compiled: Any = None  # a `CompiledTip`, whose module imports an extra

    def hasten(self, *, is_wanted: bool = True) -> bool:
        """Search by compiled code from now on, if that is wanted and numba is installed; return whether it does.

        The first time on a machine, this takes some seconds of compiling.
        """
        self._is_hastened, self._compiled = is_wanted and is_installed(), None
        if (tip := self.compiled) is not None:
            tip.warm_up()
        return self._is_hastened

    @property
    def compiled(self) -> Any:
        """Return the compiled way to the tip, a `CompiledTip`; None before `hasten`."""
        if self._is_hastened and self._compiled is None:
            from rbxcompose.domains.arms.motion.compiled_descent import CompiledTip

            self._compiled = CompiledTip(self.body, self.group, self._positions)
        return self._compiled

    def place(self, positions: Mapping[str, float]) -> None:
        """Set where all other joints are [rad or m]; one that is not in `positions` is at rest."""
        self._positions, self._base, self._compiled = dict(positions), self.whole.q(positions), None

    @property
    def positions(self) -> Mapping[str, float]:
        """Return where the other joints were set to be [rad or m]."""
        return self._positions

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
        return self._pinocchio.XYZQUATToSE3(np.array((*pose.translation, *pose.rotation), dtype=float))

    def error(self, values: Array, wanted: Any) -> tuple[Array, Array]:
        """Return how far the tip is from where it is wanted, of shape (6,), and its Jacobian, of shape (6, n).

        Both are in the frame of the tip: three lengths [m], then three angles [rad].
        """
        pinocchio, data = self._pinocchio, self.whole.data
        jacobian = pinocchio.computeFrameJacobian(self.whole.model, data, self.q(values), self._tip, pinocchio.LOCAL)
        # It leaves the frame in the root's as the first of `iMf`, and the frame's own placement as it was.
        away, error = data.iMf[0].actInv(wanted), np.empty(6)
        error[:3], error[3:] = away.translation, pinocchio.log3(away.rotation)
        return error, jacobian @ self._columns

    def tip(self, values: Array, *, with_jacobian: bool) -> tuple[Array, Array, Array]:
        """Return where the tip is [m], its rotation as a matrix, and its Jacobian of shape (6, n), all in the root.

        Without the Jacobian, that has the shape (0, n).
        """
        pinocchio, model, data, q = self._pinocchio, self.whole.model, self.whole.data, self.q(values)
        if with_jacobian:
            pinocchio.computeJointJacobians(model, data, q)
        else:
            pinocchio.forwardKinematics(model, data, q)
        here = pinocchio.updateFramePlacement(model, data, self._tip)
        jacobian = np.zeros((0, len(self.group.joints)))
        if with_jacobian:
            found = pinocchio.getFrameJacobian(model, data, self._tip, pinocchio.LOCAL_WORLD_ALIGNED)
            jacobian = np.asarray(found @ self._columns)
        return np.array(here.translation), np.array(here.rotation), jacobian

    def q(self, values: Array) -> Array:
        """Return the configuration for positions of the arm's joints, of shape (n,)."""
        found, (places, indices, multipliers, offsets) = self._base.copy(), self._entries
        found[places] = multipliers * values[indices] + offsets
        places, indices, multipliers, offsets = self._turning
        if len(places):
            angles = multipliers * values[indices] + offsets
            found[places], found[places + 1] = np.cos(angles), np.sin(angles)
        return found

    def _entry(self, name: str) -> _Entry | None:
        joint = self.body.joints[name]
        leader, multiplier, offset = leader_of(joint, self.body.joints)
        if leader not in self.group.joints:
            return None
        index = self.group.joints.index(leader)
        column = self.whole.model.joints[self.whole.model.getJointId(name)].idx_v
        return _Entry(self.whole.places[name], column, index, multiplier, offset, joint.kind == "continuous")
