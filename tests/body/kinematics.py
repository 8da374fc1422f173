"""Where the links of a body are, by ours and by two libraries, as matrices."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.geometry import Transform3, rotate
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.pinocchio_model import PinocchioModel
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf

Array = NDArray[np.float64]
Positions = Mapping[str, float]
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def description_of(text: str) -> Description:
    """Return what a URDF describes, which must be right."""
    root = read_urdf(text, "robot.urdf")
    assert isinstance(root, XmlElement), root
    body, findings = read_body(root)
    assert not findings
    return Description(text, body)


def matrix(pose: Transform3) -> Array:
    """Return a pose as a homogeneous matrix."""
    found = np.eye(4)
    found[:3, 3] = pose.translation
    found[:3, :3] = np.transpose([rotate(pose.rotation, axis) for axis in AXES])
    return found


class Three:
    """A body in three libraries."""

    def __init__(self, description: Description) -> None:
        self.body = description.body
        self.pinocchio = PinocchioModel(description)
        # The parser refuses texts that declare an encoding, and wants bytes.
        import yourdfpy  # as long as a second, which only those who compare need

        self.yourdfpy = yourdfpy.URDF.load(io.BytesIO(description.text.encode()), load_meshes=False)

    def poses(self, positions: Positions) -> Mapping[str, dict[str, Array]]:
        """Return the pose of each link, by library."""
        own = {joint.name: self.body.position(joint, positions) for joint in self.body.moving}
        self.yourdfpy.update_cfg(own)
        root = self.body.root
        return {
            "ours": {name: matrix(pose) for name, pose in self.body.poses(positions).items()},
            "pinocchio": {name: matrix(pose) for name, pose in self.pinocchio.poses(positions).items()},
            "yourdfpy": {name: self.yourdfpy.get_transform(name, root) for name in self.body.links},
        }

    def largest_difference(self, positions: Positions) -> float:
        """Return by how much an entry of a matrix differs at most [m, or 1 for a rotation]."""
        by = self.poses(positions)
        assert by["ours"].keys() == by["pinocchio"].keys() == by["yourdfpy"].keys()
        ours = np.array([by["ours"][name] for name in self.body.links])
        others = [np.array([by[library][name] for name in self.body.links]) for library in ("pinocchio", "yourdfpy")]
        return max(float(np.abs(ours - other).max()) for other in others)
