"""Where an arm is, as missions and programs ask it, and positions that it remembers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rbxcompose.base.geometry import rpy_from_quaternion
from rbxcompose.base.printable import plain
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.msgs.rbxcompose_msgs import LocateArm
from rbxcompose.sdk import Port, Serves

LOCATE = "locate"  # the port
MOST_REMEMBERED, LONGEST_NAME = 100, 100


def location_ports(config: ArmConfig) -> dict[str, Port[Any]]:
    """Return the service that reports where an arm is."""
    return {LOCATE: Serves(LocateArm, f"{config.name}/locate", skill=f"locate_{config.name}").named(LOCATE)}


class LocationService:
    """Tells where an arm is, and remembers that."""

    config: ArmConfig
    works: ArmWorks
    measured: dict[str, tuple[float, float]]
    """Position and velocity of each joint."""
    remembered: dict[str, dict[str, float]]
    """Positions of joints [rad or m] by the names that were given to them."""

    @property
    def poses(self) -> Mapping[str, Mapping[str, float]]:
        """Return the poses by name, those of the manifest and those that it remembers."""
        return {**self.remembered, **self.config.poses}

    def on_locate(self, request: LocateArm.Request) -> LocateArm.Response:
        """Tell where the tip and the joints are."""
        if problem := self._unfit(request):
            return LocateArm.Response(message=problem)
        space, kinematics = self.works.space, self.works.kinematics
        at = {name: position for name, (position, _) in self.measured.items()}
        joints = {name: at[name] for name in space.names}
        links, frame = kinematics.body.poses(at), request.frame or kinematics.body.root
        tip = links[frame].inverse().compose(links[kinematics.group.tip])
        roll, pitch, yaw = rpy_from_quaternion(tip.rotation)
        if request.remember:
            self.remembered[request.remember] = joints
        place = ", ".join(
            f"{axis} {_shown(value * 100)} cm" for axis, value in zip("xyz", tip.translation, strict=True)
        )
        turn = ", ".join(
            f"{axis} {_shown(math.degrees(value))} deg"
            for axis, value in zip(("roll", "pitch", "yaw"), (roll, pitch, yaw), strict=True)
        )
        each = ", ".join(joint.shown(joints[joint.name]) for joint in space.joints)
        words = f"'{kinematics.group.tip}' in '{frame}': {place}, {turn}; joints from the base: {each}"
        x, y, z = tip.translation
        return LocateArm.Response(success=True, message=words, x=x, y=y, z=z, roll=roll, pitch=pitch, yaw=yaw)

    def _unfit(self, request: LocateArm.Request) -> str:
        """Return why that cannot be reported or remembered, nothing if it can."""
        name, frame = request.remember, request.frame
        if unknown := [joint for joint in self.works.space.names if joint not in self.measured]:
            return f"nothing has reported where '{unknown[0]}' is"
        if frame and frame not in self.works.kinematics.body.links:
            return f"there is no link '{plain(frame)}'"
        if name in self.config.poses:
            return f"'{name}' is a pose of this arm: remember where it is by another name"
        if len(name) > LONGEST_NAME:
            return f"the name to remember has more than {LONGEST_NAME} characters"
        if name and name not in self.remembered and len(self.remembered) >= MOST_REMEMBERED:
            return f"it remembers {MOST_REMEMBERED} names already: use one of them again"
        return ""


def _shown(value: float) -> str:
    """Return a number for people, without a sign of 0."""
    return f"{round(value, 1) + 0.0:.1f}"
