"""Words of other tools: keys, tags and launch substitutions, with what is written here instead."""

import re
from collections.abc import Container, Mapping
from typing import NamedTuple

from rbxcompose.base.findings import Finding, Span, kind
from rbxcompose.base.printable import plain

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
    "baud": "baudrate baud_rate bitrate",
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

_CONTROLLERS = {
    "joint_trajectory": "joint_trajectory_controller JointTrajectoryController",
    "joint_command": "forward_command_controller ForwardCommandController position_controllers "
    "JointGroupPositionController JointPositionController position_controller",
    "gripper": "gripper_action_controller GripperActionController GripperController parallel_gripper_action_controller",
    "diff_drive": "diff_drive_controller DiffDriveController",
    "gpio": "gpio_controllers GpioCommandController GPIOController",
}
CONTROLLERS: Mapping[str, str] = {name: ours for ours, names in _CONTROLLERS.items() for name in names.split()}
"""Our type of a controller for each package and class of ros2_control and ros_control."""
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


_OF_VARIABLES = ("!env", "!env_var", "!ENV", "!ENV_VAR")


def help_for_tag(tag: str, value: str) -> str:
    """Return what to write in place of a tag that manifests do not have, and of the value after it."""
    word = plain(value.split()[0], 60) if value.split() else "NAME"
    if tag in _OF_VARIABLES:
        return f"write '${{env.{word}}}'"
    if tag == "!secret":
        return f"write '${{secret.{word}}}'"
    if tag.startswith("!include"):
        return "write its contents here; a part of a robot in a file of its own is named below 'include'"
    return "put quotes around it if it is text; the only tags are '!remove' and '!replace'"


PATTERN = r"\$\((?P<verb>arg|var|env|optenv|find|find-pkg-share|eval|anon) (?P<of>[^)$]*)\)"
_WITH_DEFAULT = re.compile(r"(?P<name>(?:args\.)?+[A-Za-z_]\w*+)(?P<rest>:?+[-?].*+)", re.DOTALL)
_ARGUMENTS = ("arg", "var")
_PATHS = ("find", "find-pkg-share")


class Cure(NamedTuple):
    """What to do instead, and the text that surely means the same; empty if there is none."""

    help: str
    meant: str = ""


def cure_of_variable(body: str) -> Cure | None:
    """Return the cure of a variable with a default as a shell and Docker Compose have it; None for anything else."""
    found = _WITH_DEFAULT.fullmatch(body.strip())
    if found is None:
        return None
    name, rest = found["name"], plain(found["rest"], 60)
    if name.startswith("args."):
        return Cure(f"write '${{{name}}}', and its 'default' where it is declared below 'args'")
    return Cure(f"write '${{env.{name}{rest}}}'", f"${{env.{name}{found['rest']}}}")


def cure_of(verb: str, of: str, known: Container[str], *, runs: bool) -> Cure:
    """Return the cure of a substitution; `known` are the names to fill in, `runs` tells that it is in a mission."""
    name = of.strip().partition(" ")[0]
    if verb in _ARGUMENTS and runs:
        return Cure(f"write '${name}', and declare '{name}' under 'inputs'")
    if verb in _ARGUMENTS:
        filled = f"${{args.{name}}}"
        if f"args.{name}" in known:
            return Cure(f"write '{filled}'", filled)
        return Cure(f"write '{filled}', and declare '{name}' under 'args'")
    if verb == "env":
        return Cure(f"write '${{env.{name}}}'", f"${{env.{name}}}")
    if verb == "optenv":
        return Cure(f"write '${{env.{name}:-DEFAULT}}'")
    if verb in _PATHS:
        return Cure("a path is relative to the file that writes it: write it without this")
    return Cure("write the value, or fill it in by '${...}'")


XML = kind("RBX1320")

_ABOVE = re.compile(r"\s*+(?:<\?.*?\?>\s*+|<!--.*?-->\s*+|<!DOCTYPE[^>]*+>\s*+)*+", re.DOTALL)
_ROOT = re.compile(r"<([A-Za-z_][\w.:-]*+)")
_TREE = "a behaviour tree: write it as a mission; 'fallback', 'sequence' and 'parallel' are steps"
_FOREIGN_TEXT_CURES: Mapping[str, str] = {
    "robot": "a URDF: a robot names it by 'body: {urdf: FILE}'",
    "xacro": "a xacro file: a robot names it by 'body: {xacro: FILE}'",
    "launch": "a ROS launch file: write its nodes as 'components'; 'rbxcompose new robot NAME' begins a robot",
    "root": _TREE,
    "BehaviorTree": _TREE,
    "scxml": "a state machine: write it as a mission with 'machine'",
    "sdf": "an SDF file: the body of a robot is a URDF, named by 'body: {urdf: FILE}'",
}


def foreign_text(text: str, file: str) -> Finding | None:
    """Return the finding about a text that is XML, with what its root element tells; None for any other text."""
    if not text[:1000].lstrip().startswith("<"):
        return None
    above = _ABOVE.match(text)
    root = _ROOT.match(text, above.end() if above else 0)
    if root is None:
        return None
    line = text.count("\n", 0, root.start()) + 1
    column = root.start() - text.rfind("\n", 0, root.start())
    span = Span(file, line, column, line, column + len(root[0]))
    known = _FOREIGN_TEXT_CURES.get("xacro" if root[1] == "robot" and "xacro:" in text else root[1], "")
    return XML.at(span, "this is XML; a manifest is YAML", help=f"this is {known}" if known else "")
