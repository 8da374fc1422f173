"""Keys of other tools for which ours are known: of Docker Compose, of ROS launch files."""

from __future__ import annotations

from collections.abc import Mapping

_OURS = {
    "components": "services nodes",
    "starts_after": "depends_on requires",
    "connect": "remap remapping remappings",
    "restart": "respawn restart_policy",
    "log": "log_level loglevel",
    "speed": "velocity vel",
    "max_speed": "max_velocity max_vel",
    "max_turn_rate": "max_angular_velocity max_rotation_speed",
    "turn_rate": "angular_velocity rotation_speed",
    "heading": "yaw theta",
    "colour": "color",
}
FOREIGN: Mapping[str, str] = {name: ours for ours, names in _OURS.items() for name in names.split()}
"""Our key for each of theirs."""
