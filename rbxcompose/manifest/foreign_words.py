"""Keys of other tools: those for which ours are known, and those that need something else here."""

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
    "match": "contains startswith",
}
FOREIGN: Mapping[str, str] = {name: ours for ours, names in _OURS.items() for name in names.split()}
"""Our key for each of theirs."""

_CURES = {
    "settings of a component are keys of its own; '${env.NAME}' fills in a variable, and the domain is 'domain' below "
    "'bus'": "environment env env_file",
    "components run as processes of this machine, without containers: remove it": "image build volumes networks "
    "container_name privileged",
    "components find each other by topics: remove it": "expose links network_mode",
    "'profiles' is a section of the file: 'profiles: {NAME: {components: {...}}}'": "profiles",
    "the clock belongs to the bus: write 'clock: external' below 'bus'": "use_sim_time",
    "joints are driven by the sections 'buses', 'actuators', 'joints' and 'controllers'": "ros2_control "
    "controller_manager hardware_interface transmission transmissions",
    "'rbx: 1' is the version of the file: remove it": "version",
    "a component has a 'type' instead": "package pkg executable exec node_type",
}
CURES: Mapping[str, str] = {name: cure for cure, names in _CURES.items() for name in names.split()}
"""What to do instead of a key that has no counterpart."""
MESSAGES: Mapping[str, str] = {
    "Bool": "flag",
    "String": "text",
    **dict.fromkeys(("Float32", "Float64"), "number"),
    **{f"{sign}Int{size}": "number" for sign in ("", "U") for size in (8, 16, 32, 64)},
}
"""The type of a value for each message of `std_msgs` with one field."""
