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
    "with": "params parameters arguments vars",
    "from": "source src",
    "wheel_distance": "wheel_separation wheel_track track_width wheelbase",
}
FOREIGN: Mapping[str, str] = {name: ours for ours, names in _OURS.items() for name in names.split()}
"""Our key for each of theirs."""

_TYPES = {
    "number": "float float32 float64 double real decimal",
    "count": "int integer int32 int64 uint unsigned",
    "text": "string str std::string",
    "flag": "bool boolean",
    "choice": "enum enumeration",
    "time": "duration seconds period",
    "length": "distance metres meters",
    "speed": "velocity",
    "angular_speed": "angular_velocity",
    "ratio": "percent percentage fraction",
    "place": "location waypoint",
    "list": "array sequence vector",
    "map": "dict object struct",
}
TYPES: Mapping[str, str] = {name: ours for ours, names in _TYPES.items() for name in names.split()}
"""Our type of an argument for each of theirs."""

_COMPONENTS = {
    "go_to": "move_base nav2 navigation navigator bt_navigator NavigateToPose",
    "diff_drive_sim": "diff_drive_controller differential_drive create turtlebot arbotix",
    "charger": "docking dock docking_server opennav_docking",
    "robot_description": "robot_state_publisher",
    "transforms": "tf tf2 static_transform_publisher",
    "topic_monitor": "rate_monitor hz_monitor frequency_monitor topic_hz",
    "memory_monitor": "ram_monitor mem_monitor",
    "host_battery": "battery_monitor laptop_battery",
    "diagnostics": "diagnostic_aggregator aggregator_node",
}
COMPONENTS: Mapping[str, str] = {name: ours for ours, names in _COMPONENTS.items() for name in names.split()}
"""Our type of a component for each node of ROS, or for what people call it."""
CHOICES: Mapping[str, str] = {
    "unless-stopped": "always",
    "on-failure": "on_failure",
    "no": "never",
    "error": "on_failure",
}
"""Our word for each of theirs, where a key takes one of a few."""

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
    "'rbx: 1' is the version of the language: write it instead": "apiVersion",
    "the keys below it belong at the top of the file: move them there": "metadata spec",
    "both ends belong to one key: 'position: [-90 deg, 90 deg]'": "lower upper min_position max_position",
    "arguments are below 'args', each with its type and default": "substitutions launch_arguments",
    "what is done only sometimes belongs in a profile: 'profiles: {NAME: {components: {...}}}'": "condition unless",
    "a component has a 'type' instead": "package pkg executable exec node_type command entrypoint",
    "diagnostics watch each component; a group of its own is an entry below 'analyzers'": "healthcheck",
    "one topic is renamed by 'connect: {PORT: TOPIC}', all of a robot by 'namespace' below 'bus'": "namespace ns",
    "what it writes is in 'rbxcompose logs': remove it": "output emulate_tty logging",
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
