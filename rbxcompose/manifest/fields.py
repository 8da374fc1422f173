"""Types of fields that several sections have."""

import math
from typing import Annotated

from pydantic import AfterValidator, StringConstraints, ValidationInfo

from rbxcompose.base.config import COMPONENT, FILE, LINK, PORT, TOPIC, Angle, Config, Length, Name, Refers
from rbxcompose.base.geometry import Transform3, quaternion_from_rpy

TopicPattern = StringConstraints(pattern=r"^/?[a-z][a-z0-9_]*(/[a-z][a-z0-9_]*)*$", max_length=255)
TopicName = Annotated[str, TopicPattern, Refers(TOPIC, is_reported=True)]
InterfaceName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*(/(msg|srv|action))?/[A-Z][A-Za-z0-9]*$")]
DottedName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)?$", max_length=121)]
FieldPath = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)*$", max_length=255)]
PortName = Annotated[DottedName, Refers(PORT, is_reported=True)]
ComponentName = Annotated[Name, Refers(COMPONENT, is_reported=True)]
FileName = Annotated[str, Refers(FILE, is_reported=True)]


def _beyond_nearest(farthest: float, info: ValidationInfo) -> float:
    if farthest <= info.data.get("nearest", -math.inf):
        raise ValueError("'farthest' must be more than 'nearest', or nothing is seen")
    return farthest


Farthest = Annotated[Length, AfterValidator(_beyond_nearest)]
"""How far a sensor sees; its configuration has `nearest` before it. With a default, it needs `validate_default`."""


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

    to: Annotated[str, Refers(LINK, is_reported=True)]
    """A link of the robot: of another piece, with its prefix, or of the robot's own body."""
    at: FramePose = FramePose()
    """Pose of the piece's root link in that link."""
