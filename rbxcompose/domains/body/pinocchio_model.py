"""The body in Pinocchio, a library of kinematics and dynamics; it is the extra `arm`, and imported when it is used.

Pinocchio has its own order of joints, and a continuous joint is two entries of its `q`, a cosine and a sine. So joints
and frames are found by their names here, and never counted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rbxcompose.base.arrays import Array
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.body.description import Description

Pinocchio = Any  # of an extra, without types


class PinocchioModel:
    """A body as `model`, with the `data` that computations leave; one thread at a time may use it.

    A joint that mimics another is a joint of its own in `model`; its entry of `q` follows the other one. Planar and
    floating joints are where their origins are, as in `Body`.
    """

    def __init__(self, description: Description) -> None:
        """Build it from the URDF.

        Raises:
            ModuleNotFoundError: without Pinocchio.
            ValueError: if Pinocchio refuses the URDF; it wants limits with 'effort' and 'velocity', for example.
        """
        import pinocchio

        self.body = description.body
        self.model: Pinocchio = pinocchio.buildModelFromXML(description.text)
        self.data: Pinocchio = self.model.createData()
        self.neutral: Array = pinocchio.neutral(self.model)
        frames = {name: self.model.getFrameId(name, pinocchio.BODY) for name in self.body.links}
        self.frames: Mapping[str, int] = frames
        """The index of each link's frame."""
        moving = [joint for joint in self.body.joints.values() if joint.moves]
        joints = {joint.name: self.model.joints[self.model.getJointId(joint.name)] for joint in moving}
        self.places: Mapping[str, int] = {name: joint.idx_q for name, joint in joints.items()}
        """The first entry of each joint in `q`."""

    def q(self, positions: Mapping[str, float]) -> Array:
        """Return the configuration at positions of joints [rad or m]; one that is not in `positions` is at rest."""
        found = self.neutral.copy()
        for name, place in self.places.items():
            joint = self.body.joints[name]
            position = self.body.position(joint, positions)
            if joint.kind == "continuous":
                found[place : place + 2] = math.cos(position), math.sin(position)
            else:
                found[place] = position
        return found

    def pose(self, link: str, positions: Mapping[str, float]) -> Transform3:
        """Return the frame of one link in that of the root."""
        self._place_frames(positions)
        return self._pose(link)

    def poses(self, positions: Mapping[str, float]) -> dict[str, Transform3]:
        """Return the frame of every link in that of the root."""
        self._place_frames(positions)
        return {link: self._pose(link) for link in self.frames}

    def _place_frames(self, positions: Mapping[str, float]) -> None:
        import pinocchio

        pinocchio.framesForwardKinematics(self.model, self.data, self.q(positions))

    def _pose(self, link: str) -> Transform3:
        import pinocchio

        x, y, z, *rotation = pinocchio.SE3ToXYZQUAT(self.data.oMf[self.frames[link]]).tolist()
        return Transform3((x, y, z), (rotation[0], rotation[1], rotation[2], rotation[3]))
