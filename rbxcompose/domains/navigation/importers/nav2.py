"""`nav2`: files of parameters of Nav2, and of move_base and amcl of ROS 1.

What the parameters mean: https://docs.nav2.org/configuration/ and https://wiki.ros.org/costmap_2d.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import PurePath
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Related, Report, Severity, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.commands.importing.foreign_files import ForeignFile, ForeignMap, Given, maps_in
from rbxcompose.commands.importing.importer import (
    CLOCK,
    LEFT_OPEN,
    NOT_CARRIED_OVER,
    OTHER_PROGRAM,
    RENAMED_TOPIC,
    importer,
)
from rbxcompose.commands.importing.manifest_text import (
    Row,
    angle,
    flag,
    flow,
    header,
    length,
    place,
    quantity,
    row,
    section,
    word,
)
from rbxcompose.commands.importing.ros_parameters import NodeParameters, parameters_of, scalars_of, topic_name, value_of
from rbxcompose.domains.body.lint import TURN, TURNED_IN_DEGREES
from rbxcompose.domains.worlds.shapes import PolygonFootprint, convex_hull
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.manifest.validate import WRONG_TYPE, label_of, to_plain

ROUND = kind("RBX2298", Severity.WARNING)

GLOBAL, LOCAL, COMMON = "global_costmap", "local_costmap", "costmap"
SLIM = 0.01  # [m] around the origin that a footprint covers at least
_LONGEST = 220  # characters of a list of names in a finding
_NUMBERED = (float, int)


_speed = partial(quantity, unit="m/s")
_turn_rate = partial(quantity, unit="rad/s")
_acceleration = partial(quantity, unit="m/s^2")
_TOLERANCES: Mapping[str, tuple[tuple[str, ...], Callable[[float], str]]] = {
    "follower.tolerance": (("xy_goal_tolerance",), length),
    "follower.heading_tolerance": (("yaw_goal_tolerance",), angle),
}
_FOLLOWER: Mapping[str, tuple[tuple[str, ...], Callable[[float], str]]] = {
    "follower.speed": (
        ("desired_linear_vel", "max_linear_vel", "max_vel_x", "vx_max", "v_linear_max", "max_vel_trans"),
        _speed,
    ),
    "follower.turn_rate": (
        ("rotate_to_heading_angular_vel", "max_vel_theta", "wz_max", "v_angular_max", "max_rotational_vel"),
        _turn_rate,
    ),
    "follower.acceleration": (("max_linear_accel", "acc_lim_x", "ax_max"), _acceleration),
    "follower.look_ahead": (("lookahead_dist",), length),
    **_TOLERANCES,
}
"""Settings, and the parameters of controllers that say the same; of several, the first one counts."""
_SIGNS: Mapping[str, frozenset[str]] = {
    "amcl": frozenset({"odom_model_type", "laser_model_type", "min_particles", "initial_pose_x"}),
    COMMON: frozenset({"robot_radius", "footprint", "obstacle_range", "inflation_radius", "observation_sources"}),
    "move_base": frozenset({"base_local_planner", "base_global_planner", "recovery_behavior_enabled"}),
}
"""Parameters by which a map without a name is known, in files of ROS 1."""
_ELSEWHERE: Mapping[str, str] = {
    "bt_navigator": "what the robot tries when it gets no further is a mission here, which 'recoveries' names",
    "behavior_server": "'back_up' and 'spin' are skills of the mission that 'recoveries' names",
    "recoveries_server": "'back_up' and 'spin' are skills of the mission that 'recoveries' names",
    "smoother_server": "planned ways are made straight where that costs nothing",
    "waypoint_follower": "missions drive to one place after another",
    "map_saver": "'rbxcompose map save' writes a map",
    "collision_monitor": "the follower stops in time for what the laser sees",
    "docking_server": "missions dock",
    "route_server": "ways are planned on the map alone",
    "loopback_simulator": "'world' simulates the robot",
    "robot_state_publisher": "'body' publishes the frames",
}
_PARTS_OF_NODES = ("_client", "_rclcpp_node")  # which Nav2 had for some years, with a clock of their own
_STRANGER = "it is no node of navigation"
_SIDEWAYS = "the follower never drives sideways"


@dataclass(frozen=True, slots=True)
class ForeignSetting:
    """A setting: its value and text in a manifest, and the place and name of what it was."""

    value: object
    text: str
    span: Span
    was: str


class ForeignNavigation:
    """The settings that files have, by their paths in `navigation`; of several values, the first one counts."""

    def __init__(self, report: Report) -> None:
        self.report = report
        self.found: dict[str, ForeignSetting] = {}
        self.has_clock = False

    def take(self, setting: str, value: object, text: str, span: Span, was: str) -> None:
        """Take a value of a setting; if it has another one already, report this one."""
        first = self.found.setdefault(setting, ForeignSetting(value, text, span, was))
        if first.value != value:
            words = f"'{was}' is not carried over: '{setting}' has another value already"
            self.report.add(NOT_CARRIED_OVER.at(span, words, related=[Related(first.span, f"'{first.was}'")]))

    def take_number(self, setting: str, given: ForeignMap, keys: Sequence[str], write: Callable[[float], str]) -> None:
        """Take a number above 0 from the first of some keys that a map has."""
        for key in keys:
            if (found := given.above_zero(key)) is not None:
                self.take(setting, found.value, write(found.value), found.span, key)
                if write is angle:
                    self.judge_angle(found, f"'{key}'")
                break

    def judge_angle(self, given: Given[float], was: str) -> None:
        """Report an angle that may be in degrees."""
        if abs(given.value) > TURN:
            words = f"{was} is {given.value:g} rad, which is more than a turn: are these degrees?"
            help_text = f"angles in Nav2 are in radians: for degrees, write {math.radians(given.value):.4g}"
            self.report.add(TURNED_IN_DEGREES.at(given.span, words, help=help_text))

    def limit(self, setting: str, value: float, text: str, span: Span, was: str) -> None:
        """Take a value if there is none, or only a larger one."""
        known = self.found.get(setting)
        if known is None or (isinstance(known.value, _NUMBERED) and value < known.value):
            self.found[setting] = ForeignSetting(value, text, span, was)

    def topic(self, setting: str, found: Given[str], was: str = "topic") -> None:
        """Take the topic of a laser."""
        name = topic_name(found.value.strip())
        if name != found.value.strip():
            words = f"the topic '{plain(found.value, 60)}' becomes '{name}'"
            self.report.add(RENAMED_TOPIC.at(found.span, words, help="the laser must publish there"))
        self.take(setting, name.lstrip("/"), name, found.span, was)

    def leave(self, span: Span, name: str, why: str) -> None:
        """Report what is left out."""
        self.report.add(NOT_CARRIED_OVER.at(span, f"'{plain(name, 60)}' is not carried over: {why}"))

    def leave_rest(self, given: ForeignMap) -> None:
        """Report in one finding all of a map that nobody has asked for."""
        if given.is_set("use_sim_time") and not self.has_clock:
            self.has_clock = True  # each node has it
            self.leave(given.places("use_sim_time")["use_sim_time"], "use_sim_time", CLOCK)
        rest = [(".".join(path), entry.key.span) for path, entry in scalars_of(MappingNode(given.rest()))]
        if not rest:
            return
        shown: list[str] = []
        for name, _ in rest:
            if sum(map(len, shown)) < _LONGEST:
                shown.append(plain(name, 60))
        more = f" and {len(rest) - len(shown)} more" if len(rest) > len(shown) else ""
        first, last = min(span for _, span in rest), max(span for _, span in rest)
        lines = f"line {first.line}" if first.line == last.line else f"lines {first.line} to {last.line}"
        words = f"'navigation' has no place for parameters of {given.what} ({lines}): {', '.join(shown)}{more}"
        self.report.add(NOT_CARRIED_OVER.at(first, words))


Reader = Callable[[ForeignNavigation, ForeignMap], None]


def _map_server(out: ForeignNavigation, given: ForeignMap) -> None:
    found = given.text("yaml_filename")
    if found is not None and "$(" in found.value:
        out.leave(found.span, found.value, "only ROS can fill it in")
    elif found is not None and found.value:
        out.take("map", found.value, word(found.value), found.span, "yaml_filename")
    out.leave_rest(given)


def _amcl(out: ForeignNavigation, given: ForeignMap) -> None:
    out.take("localisation.type", "particles", "particles", given.span, "amcl")
    if (topic := given.text("scan_topic")) is not None:
        out.topic("localisation.from", topic, "scan_topic")
    if "initial_pose" in given and given.is_set("set_initial_pose"):
        for pose in _below(given, ["initial_pose"]).values():
            _start(out, [pose.number(key) for key in ("x", "y", "yaw")])
            out.leave_rest(pose)
    else:
        _start(out, [given.number(f"initial_pose_{key}") for key in ("x", "y", "a")])
    for key, setting, write in (("initial_cov_xx", "spread", length), ("initial_cov_aa", "turn_spread", angle)):
        if (variance := given.number(key)) is not None and variance.value >= 0:
            value = math.sqrt(variance.value)
            out.take(f"localisation.{setting}", value, write(value), variance.span, key)
    if "localisation.start" not in out.found:
        words = "the files do not say where the robot starts: the filter begins at the origin of the map"
        help_text = "write 'start' below 'localisation', or 'anywhere: true'"
        out.report.add(LEFT_OPEN.at(given.span, words, help=help_text))
    out.leave_rest(given)


def _start(out: ForeignNavigation, numbers: Sequence[Given[float] | None]) -> None:
    given = [number for number in numbers if number is not None]
    if given:
        x, y, yaw = (0.0 if number is None else number.value for number in numbers)
        text = flow({"x": length(x), "y": length(y), "heading": angle(yaw)})
        out.take("localisation.start", (x, y, yaw), text, given[0].span, "initial pose")
        if (turned := numbers[2]) is not None:
            out.judge_angle(turned, "the yaw of the initial pose")


def _controllers(out: ForeignNavigation, given: ForeignMap) -> None:
    controllers = _names(given, "controller_plugins") or ["FollowPath"]
    checkers = _names(given, "goal_checker_plugins", "goal_checker_plugin") or ["goal_checker"]
    below = _below(given)
    if (checker := below.pop(checkers[0], None)) is not None:
        checker.what = f"{checker.what}{_plugin(checker)}"
        _take(out, checker, _TOLERANCES)
        out.leave_rest(checker)
    if (controller := below.pop(controllers[0], None)) is not None:
        _controller(out, controller)
    for name, other in below.items():
        is_checker = "ProgressChecker" in _plugin(other)
        why = (
            "'patience' of 'planner' says how long the robot may get no further"
            if is_checker
            else "only the first of its kind counts"
        )
        out.leave(other.span, name, why)
    out.leave_rest(given)


def _controller(out: ForeignNavigation, given: ForeignMap) -> None:
    given.what = f"{given.what}{_plugin(given)}"
    _take(out, given, _FOLLOWER)
    sideways, model = given.number("max_vel_y"), given.text("motion_model")
    if sideways is not None and sideways.value > 0:
        out.leave(sideways.span, "max_vel_y", _SIDEWAYS)
    if model is not None and model.value == "Omni":
        out.leave(model.span, "motion_model", _SIDEWAYS)
    for key in ("min_vel_x", "vx_min"):
        if (back := given.number(key)) is not None and back.value < 0:
            out.leave(back.span, key, "the follower drives forwards; only recoveries back up")
    out.leave_rest(given)


def _take(
    out: ForeignNavigation, given: ForeignMap, table: Mapping[str, tuple[tuple[str, ...], Callable[[float], str]]]
) -> None:
    for setting, (keys, write) in table.items():
        out.take_number(setting, given, keys, write)


def _velocity_smoother(out: ForeignNavigation, given: ForeignMap) -> None:
    """Take limits; the smoother comes behind the controller, so the lower ones count."""
    for key, index, setting, write in (
        ("max_velocity", 0, "follower.speed", _speed),
        ("max_velocity", 2, "follower.turn_rate", _turn_rate),
        ("max_accel", 0, "follower.acceleration", _acceleration),
    ):
        node = given.node.get(key)
        found = value_of(node) if node is not None else None
        span = given.places(key).get(key, given.span)
        values = found.value if found is not None and isinstance(found.value, list) else []
        if len(values) == 3 and isinstance(value := values[index], _NUMBERED) and value > 0:
            out.limit(setting, float(value), write(float(value)), span, key)
    out.leave_rest(given)


def _costmap(out: ForeignNavigation, given: ForeignMap, *, plans: bool = True) -> None:
    """Take what a costmap says; here is one grid of costs, for planning, so the costmap that `plans` is read first."""
    if not _footprint(out, given):
        out.take_number("footprint", given, ["robot_radius"], _circle)
    used, filters = _names(given, "plugins", "plugin_names"), _names(given, "filters") or []
    types = _types(given)
    _layer(out, given, plans=plans)
    for name, layer in _below(given).items():
        if name in filters:
            out.leave(layer.span, name, "draw its mask as 'zones' of 'costs', with 'keep_out' or 'speed'")
        elif used and name not in used:
            out.leave(layer.span, name, f"{given.what} does not use it")
        elif (is_on := layer.flag("enabled")) is not None and not is_on.value:
            out.leave(layer.span, name, "it is not enabled")
        else:
            type_ = types.get(name) or _plugin(layer)
            layer.what = f"{layer.what}{_plugin(layer)} of {given.what}"
            _layer(out, layer, plans=plans, inflates="InflationLayer" in type_ if type_ else "inflation" in name)
            out.leave_rest(layer)
    out.leave_rest(given)


def _circle(radius: float) -> str:
    return flow({"radius": length(radius)})


def _footprint(out: ForeignNavigation, given: ForeignMap) -> bool:
    """Take the corners of a footprint, or of what is around it; return whether there is one."""
    node = given.node.get("footprint")
    if node is None:
        return False
    given.places("footprint")
    corners = _corners(node)
    if corners is None:
        words = f"'footprint' of {given.what} must be a list of points"
        out.report.add(WRONG_TYPE.at(node.span, words, label=label_of(node)))
    elif corners:
        hull = convex_hull((round(x, 4), round(y, 4)) for x, y in corners)
        if len(hull) > 2 and PolygonFootprint(hull).inner > SLIM:
            text = f"[{', '.join(f'[{length(x)}, {length(y)}]' for x, y in hull)}]"
            out.take("footprint", hull, text, node.span, "footprint")
            words = "" if len(hull) == len(corners) else "the footprint becomes its convex hull"
        else:
            radius = round(max(math.hypot(x, y) for x, y in corners), 6)
            out.take("footprint", radius, _circle(radius), node.span, "footprint")
            words = f"the footprint is not around the robot: it becomes a circle with a radius of {length(radius)}"
        if words and out.found["footprint"].span == node.span:
            out.report.add(ROUND.at(node.span, words))
    return bool(corners)


def _corners(node: TreeNode) -> list[tuple[float, float]] | None:
    """Return the corners of a footprint, which Nav2 has as a text; None if they are none."""
    try:
        listed: Any = json.loads(node.text) if isinstance(node, ScalarNode) else to_plain(node)
        corners = [(float(x), float(y)) for x, y in listed]
        return corners if all(map(math.isfinite, chain.from_iterable(corners))) else None
    except (ValueError, TypeError, RecursionError):
        return None


def _layer(out: ForeignNavigation, given: ForeignMap, *, plans: bool, inflates: bool = True) -> None:
    if inflates:  # others may have such a parameter, too, and ignore it
        out.take_number("costs.inflation.radius", given, ["inflation_radius"], length)
    if plans and (tracks := given.flag("track_unknown_space")) is not None:
        out.take("tracks", tracks.value, "", tracks.span, "track_unknown_space")
    names = given.text("observation_sources")
    sources = _below(given, names.value.split() if names else [])
    lasers = [(name, source) for name, source in sources.items() if _is_laser(out, name, source)]
    for name, source in lasers[:1]:
        out.topic("costs.obstacles.from", source.text("topic") or Given(name, source.span))
        out.take_number("costs.obstacles.range", source, ["obstacle_max_range", "obstacle_range"], length)
        if (silence := source.number("expected_update_rate")) is not None and silence.value > 0:
            text = quantity(silence.value, "s")
            out.take("costs.obstacles.silence", silence.value, text, silence.span, "expected_update_rate")
        out.leave_rest(source)
    for name, source in lasers[1:]:
        out.leave(source.span, name, f"obstacles come from one laser, '{lasers[0][0]}'")
    out.take_number("costs.obstacles.range", given, ["obstacle_max_range", "obstacle_range"], length)


def _is_laser(out: ForeignNavigation, name: str, source: ForeignMap) -> bool:
    type_, marks = source.text("data_type"), source.flag("marking")
    if type_ is not None and type_.value != "LaserScan":
        out.leave(source.span, name, f"it is a {plain(type_.value, 40)}, and obstacles come from a laser")
    elif marks is not None and not marks.value:
        out.leave(source.span, name, "it only clears")
    else:
        return True
    return False


def _planners(out: ForeignNavigation, given: ForeignMap) -> None:
    planners = _names(given, "planner_plugins", "planner_plugin_ids") or ["GridBased"]
    for name, planner in _below(given).items():
        if name == planners[0]:
            _planner(out, planner)
        else:
            out.leave(planner.span, name, "only the first of its kind counts")
    out.leave_rest(given)


def _planner(out: ForeignNavigation, given: ForeignMap) -> None:
    given.what = f"{given.what}{_plugin(given)}"
    if (allows := given.flag("allow_unknown")) is not None:
        out.take("costs.unknown", allows.value, flag(allows.value), allows.span, "allow_unknown")
    out.leave_rest(given)


def _plugin(given: ForeignMap) -> str:
    """Return the class of a plug-in in brackets; empty if it is not given."""
    found = given.text("plugin")
    return f" ({plain(found.value.rpartition(':')[2].rpartition('/')[2], 40)})" if found else ""


def _below(given: ForeignMap, names: Collection[str] | None = None) -> dict[str, ForeignMap]:
    """Return those maps in a map that nobody has asked for, or only some of them, by name."""
    rest = given.rest().items()
    nodes = {
        name: each for name, each in rest if isinstance(each.value, MappingNode) and (names is None or name in names)
    }
    given.places(*nodes)
    return dict(maps_in(MappingNode(nodes), "plug-in", given.report))


def _types(given: ForeignMap) -> dict[str, str]:
    """Return the types of layers by their names, as files of ROS 1 list them."""
    node = given.node.get("plugins")
    listed = [item for item in node.items if isinstance(item, MappingNode)] if isinstance(node, SequenceNode) else []
    named = ((item.get("name"), item.get("type")) for item in listed)
    return {
        name.text: type_.text for name, type_ in named if isinstance(name, ScalarNode) and isinstance(type_, ScalarNode)
    }


def _names(given: ForeignMap, *keys: str) -> list[str] | None:
    """Return the names that the first of some keys lists: one, several, or maps with a `name`; None without a key."""
    for key in keys:
        if given.places(key):
            node = given.node.get(key)
            items = node.items if isinstance(node, SequenceNode) else (node,)
            named = (item.get("name") if isinstance(item, MappingNode) else item for item in items)
            return [item.text for item in named if isinstance(item, ScalarNode)]
    return None


_READERS: Mapping[str, Reader] = {  # in the order in which they count
    "map_server": _map_server,
    "amcl": _amcl,
    "controller_server": _controllers,
    "TrajectoryPlannerROS": _controller,
    "DWAPlannerROS": _controller,
    "TebLocalPlannerROS": _controller,
    "velocity_smoother": _velocity_smoother,
    GLOBAL: _costmap,
    LOCAL: partial(_costmap, plans=False),
    COMMON: _costmap,
    "planner_server": _planners,
    "NavfnROS": _planner,
    "GlobalPlanner": _planner,
    "move_base": ForeignNavigation.leave_rest,
}


def _why_elsewhere(name: str) -> str:
    if "filter_info" in name or "filter_mask" in name:
        return "'zones' of 'costs' say where to keep out or to be slow"
    if name.endswith(_PARTS_OF_NODES):
        return "it is a part of another node"
    if name.startswith("lifecycle_manager"):
        return "the supervisor starts components"
    return _ELSEWHERE.get(name, _STRANGER)


def _parts(file: ForeignFile) -> Iterator[NodeParameters]:
    """Yield what belongs to each node or plug-in of a file, under the last part of its name."""
    for node in parameters_of(file):
        if isinstance(file.root, MappingNode) and node.root.span == file.root.span:
            yield from _unnamed(node.root, PurePath(file.name).stem)
        else:
            yield replace(node, node=node.node.rpartition("/")[2])


def _unnamed(root: MappingNode, name: str) -> Iterator[NodeParameters]:
    """Yield the parts of a file of ROS 1, or of `move_base` in it, which names only some of them."""
    maps = {key: entry.value for key, entry in root.entries.items() if isinstance(entry.value, MappingNode)}
    own = {key: value for key, value in maps.items() if key in _READERS or key in _ELSEWHERE}
    for key, value in own.items():
        if key == "move_base":
            yield from _unnamed(value, key)
        else:
            yield NodeParameters(key, root.entries[key].key.span, value)
    rest = MappingNode({key: entry for key, entry in root.entries.items() if key not in own}, root.span)
    known = next((part for part, signs in _SIGNS.items() if not signs.isdisjoint(rest.entries)), name)
    if rest.entries:
        yield NodeParameters(known if own or known in _SIGNS else "", next(iter(rest.entries.values())).key.span, rest)


@importer("nav2", "parameters of Nav2, and of move_base and amcl of ROS 1")
def nav2(files: Sequence[ForeignFile], name: str, report: Report) -> str:
    """Return a robot with the section `navigation` that says what the parameters say."""
    out, parts, made_from = ForeignNavigation(report), list[NodeParameters](), list[str]()
    for file in files:
        own = list(_parts(file))
        if any(part.node in _READERS for part in own):
            parts += own
            made_from.append(file.name)
        else:
            words = f"'{plain(file.name)}' has no node of Nav2 or move_base that 'navigation' stands for"
            report.add(OTHER_PROGRAM.at(file.root.span, words))
    for part in parts:
        if part.node not in _READERS:
            out.leave(part.span, part.node, _why_elsewhere(part.node))
    for wanted, read in _READERS.items():
        for part in parts:
            if part.node == wanted:
                read(out, ForeignMap(part.root, f"'{wanted}'", part.span, report))
    _settle_unknown(out, any(part.node in (GLOBAL, COMMON) for part in parts))
    if not out.found:
        return ""
    if "map" not in out.found:
        words = "the files do not name a map: a launch file does"
        report.add(LEFT_OPEN.at(parts[0].span, words, help="write 'map: FILE' below 'navigation'"))
    return f"{header('nav2', made_from, 'Robot', name)}\n{section(_rows(out.found))}"


def _settle_unknown(out: ForeignNavigation, has_costmap: bool) -> None:
    """Correct `unknown`: a costmap that does not track unknown space, as by default, takes it for free."""
    tracks, allows = out.found.pop("tracks", None), out.found.get("costs.unknown")
    if allows is not None and not allows.value and has_costmap and not (tracks and tracks.value):
        was = "allow_unknown, but without track_unknown_space unknown space is free"
        out.found["costs.unknown"] = ForeignSetting(True, "true", (tracks or allows).span, was)


_ORDER = (
    "map",
    "footprint",
    "localisation.type",
    "localisation.from",
    "localisation.start",
    "localisation.spread",
    "localisation.turn_spread",
    "costs.obstacles.from",
    "costs.obstacles.range",
    "costs.obstacles.silence",
    "costs.inflation.radius",
    "costs.unknown",
    *_FOLLOWER,
)


def _rows(found: Mapping[str, ForeignSetting]) -> Iterator[Row]:
    yield row(0, "navigation:")
    if "map" not in found:
        yield row(1, "", "map: FILE, the YAML file of its map, or that of the robot's world")
    above: tuple[str, ...] = ()
    for path in (path for path in _ORDER if path in found):
        *groups, key = path.split(".")
        for depth, group in enumerate(groups):
            if tuple(groups[: depth + 1]) != above[: depth + 1]:
                yield row(depth + 1, f"{group}:")
        above = tuple(groups)
        setting = found[path]
        yield row(len(groups) + 1, f"{key}: {setting.text}", f"{place(setting.span)}: {setting.was}")
