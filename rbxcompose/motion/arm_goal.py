"""What an arm is asked for, and what is wrong with that."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.inverse_kinematics import PoseTarget
from rbxcompose.motion.kept import Keep
from rbxcompose.motion.trace_planner import TraceWish


@dataclass(frozen=True, slots=True)
class ArmGoal:
    """What is asked for: a pose by name and positions of joints [rad or m] beside it, or a target for the tip."""

    pose: str = ""
    positions: Mapping[str, float] = field(default_factory=dict)
    target: PoseTarget | None = None
    frame: str = ""
    """The link in whose frame the target is; without it, the root."""
    speed: float = 1.0
    acceleration: float = 1.0
    trace: TraceWish | None = None
    """A way of the tip, instead of the others."""
    tolerance: float = 0.0
    """By which joints may be elsewhere at the end if they cannot be there [rad or m]."""
    keep: Keep = Keep()
    """On the whole way."""
    replans: int = 0
    """How often it is planned again because the scene has changed on the way."""
    prefer: str = ""
    """The pose of the arm that its joints should be near to where several positions do for a target."""

    def mistake(self, kinematics: ArmKinematics, poses: Collection[str]) -> str:
        """Return what is wrong with it for an arm that has poses of these names, or nothing."""
        for word, share in (("speed", self.speed), ("acceleration", self.acceleration)):
            if not (math.isfinite(share) and 0.0 < share <= 1.0):
                return f"a {word} of {share:.0%} is none"
        if problem := self.keep.mistake(kinematics):
            return problem
        aim = self.trace or self.target
        name = self.prefer if aim is not None else self.pose
        if name and name not in poses:
            return f"there is no pose '{name}'; the poses of this arm: {', '.join(poses) or 'none'}"
        if aim is not None:
            is_known = not self.frame or self.frame in kinematics.body.links
            return aim.mistake or self._mixed if is_known else f"there is no link '{self.frame}'"
        if not self.tolerance >= 0.0:
            return "a tolerance is below 0"
        if not (self.pose or self.positions):
            return "the goal has neither a pose nor positions of joints"
        unknown = [name for name in self.positions if name not in kinematics.group.joints]
        return f"'{unknown[0]}' is no joint of this arm" if unknown else ""

    @property
    def _mixed(self) -> str:
        if self.target is None or not (self.target.is_approximate and self.keep.is_about_tip):
            return ""
        return "what 'keep' asks of the tip is not possible together with 'approximate'"
