"""Where a piece of the body is attached to the rest of it."""

from __future__ import annotations

from typing import Annotated

from rbxcompose.config import Angle, Config, Length
from rbxcompose.geometry import Transform3, quaternion_from_rpy
from rbxcompose.references import LINK, Refers


class FramePose(Config):
    """A pose in another frame: first moved, then turned by roll, pitch and yaw about fixed axes, as in a URDF."""

    x: Length = 0.0
    """Forward."""
    y: Length = 0.0
    """To the left."""
    z: Length = 0.0
    """Up."""
    roll: Angle = 0.0
    """Turn about x."""
    pitch: Angle = 0.0
    """Turn about y."""
    yaw: Angle = 0.0
    """Turn about z."""

    def to_transform(self) -> Transform3:
        """Return it as a transform [m]."""
        return Transform3((self.x, self.y, self.z), quaternion_from_rpy(self.roll, self.pitch, self.yaw))


class PieceAttachment(Config):
    """The link that carries a piece, and where on it the piece begins."""

    to: Annotated[str, Refers(LINK, is_told=True)]
    """A link of the robot: of another piece, with its prefix, or of the robot's own body."""
    at: FramePose = FramePose()
    """Pose of the piece's root link in that link."""
