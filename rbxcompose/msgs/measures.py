"""What fields of common messages measure, by the comments in their texts and by REP 103: all in SI."""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.units import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_SPEED,
    FORCE,
    LENGTH,
    SPEED,
    TORQUE,
    Dimension,
)

Measures = Mapping[str, "Dimension | Measures | None"]
"""What numbers of a message measure, by field: a map for a nested message, None for what depends on other fields."""
_GEOMETRY = "geometry_msgs/msg/"
_MEASURES: Mapping[tuple[str, str], Dimension] = {
    (f"{_GEOMETRY}Twist", "linear"): SPEED,
    (f"{_GEOMETRY}Twist", "angular"): ANGULAR_SPEED,
    (f"{_GEOMETRY}Accel", "linear"): ACCELERATION,
    (f"{_GEOMETRY}Accel", "angular"): ANGULAR_ACCELERATION,
    (f"{_GEOMETRY}Wrench", "force"): FORCE,
    (f"{_GEOMETRY}Wrench", "torque"): TORQUE,
    (f"{_GEOMETRY}Pose", "position"): LENGTH,
    (f"{_GEOMETRY}Transform", "translation"): LENGTH,
    **{(f"{_GEOMETRY}Point", axis): LENGTH for axis in "xyz"},
}


def measure_of(message: str, field: str) -> Dimension | None:
    """Return what a field of a message, and all below it, measures; None if that is not known."""
    return _MEASURES.get((message, field))
