"""See what is in ROS 2, and write what a node has there into the manifest.

`scan` lists the nodes with their topics, services and actions. `pin NODE COMPONENT` declares those of a node in the
manifest, as the ports of a component of type `ros2_node`; what it declares already stays as it is.

Exit codes: 0 fine, 1 findings, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular, replace_file
from rbxcompose.base.findings import Edit, Fix, Span, apply_fixes, kind
from rbxcompose.base.requests import OutsideError
from rbxcompose.bus.names import TRANSFORMS
from rbxcompose.commands import options
from rbxcompose.commands.console import FINDINGS, NotDoneError, emit, write_report
from rbxcompose.commands.messages import to_json
from rbxcompose.commands.targets import add_path_argument, robot_path
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.domains.programs.bridge.ros_bridge import ROS_SIDE
from rbxcompose.domains.programs.sections.ros2 import RosModel, installation_of, ros2
from rbxcompose.domains.programs.watch import OWN
from rbxcompose.manifest.tree import FILE_BYTES, MappingNode, SequenceNode, TreeNode, at

GROUP = "data"
NO_ROS = kind("RBX9051")
NO_NODE = kind("RBX9052")
_LOOKS = 6.0  # [s] at most for discovery
_MORE = 30.0  # [s] for ROS to start
run = options.run_action
_SEND_GOAL = "/_action/send_goal"
KINDS = ("publishes", "subscribes", "serves", "calls", "serves_actions", "calls_actions")
"""The keys of a component, in the order in which they are written."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    python = options.argument("--python", metavar="FILE", help="the Python that has rclpy (default: as the robot says)")
    setup = options.argument("--setup", metavar="FILE", help="a setup file of ROS 2")
    domain = options.argument("--domain", type=int, metavar="N", help="the domain of ROS 2")
    where = (python, setup, domain)
    node = options.argument("node", metavar="NODE", help="a node of ROS 2, such as /lidar")
    component = options.argument("component", metavar="COMPONENT", help="a component of type ros2_node")
    as_json = options.argument("--json", action="store_true", help="answer in JSON")
    options.add_actions(
        parser,
        (
            options.Subcommand(
                "scan", "list what is in ROS 2 (the default)", _scan, (add_path_argument, *where, as_json)
            ),
            options.Subcommand(
                "pin", "declare what a node has in the manifest", _pin, (node, component, add_path_argument, *where)
            ),
        ),
    )


def _scan(arguments: argparse.Namespace) -> int:
    nodes = _nodes(arguments, _compiled(arguments))
    if arguments.json:
        emit(to_json([{"node": node.name, **node.ends, "latched": sorted(node.latched)} for node in nodes]))
        return 0
    for node in nodes:
        emit(node.name)
        for kind_ in KINDS:
            for topic, type_ in sorted(node.ends[kind_].items()):
                emit(f"  {kind_.replace('_', ' ')} {topic}: {type_}{' (latched)' if topic in node.latched else ''}")
    if not nodes:
        emit("there is no node")
    return 0


def _pin(arguments: argparse.Namespace) -> int:
    compiled = compile_robot(robot_path(arguments.path), environment=os.environ)
    if compiled.robot is None:
        write_report(compiled.report, compiled.sources)
        return FINDINGS
    nodes = {node.name: node for node in _nodes(arguments, compiled)}
    wanted = f"/{arguments.node.lstrip('/')}"
    if wanted not in nodes:
        raise NotDoneError(NO_NODE.misspelt(None, f"there is no node '{wanted}' in ROS 2", wanted, [*nodes], "nodes"))
    manifest = compiled.robot.manifest
    written = at(manifest.root, ("components", arguments.component))
    if not isinstance(written, MappingNode):
        known = [*manifest.components]
        message = f"there is no component '{arguments.component}'"
        raise NotDoneError(NO_NODE.misspelt(None, message, arguments.component, known, "components"))
    shown = written.span.file
    path, text = manifest.files[shown], compiled.sources[shown]
    edits = tuple(edits_of(nodes[wanted], written, text))
    if not edits:
        emit(f"'{arguments.component}' declares all that {wanted} has")
        return 0
    out = apply_fixes([Fix(edits, is_safe=True, title=f"what {wanted} has")], {shown: text})
    if not out.done or read_regular(path, FILE_BYTES).decode("utf-8") != text:
        message = f"'{shown}' cannot be changed: it is written in an unusual way, or has changed meanwhile"
        raise NotDoneError(NO_NODE.at(written.span, message))
    replace_file(path, out.texts[shown].encode("utf-8"))
    emit(f"{shown}: '{arguments.component}' declares what {wanted} has:")
    for edit in edits:
        emit(edit.text.strip("\n"))
    return 0


def _compiled(arguments: argparse.Namespace) -> Compilation | None:
    """Return the robot, if there is one; without, the options say where ROS 2 is."""
    if arguments.path is None and not Path("robot.yaml").exists():
        return None
    return compile_robot(robot_path(arguments.path), environment=os.environ)


def _nodes(arguments: argparse.Namespace, compiled: Compilation | None) -> list[RosNode]:
    """Look around in ROS 2.

    Raises:
        NotDoneError: if it is not there.
    """
    model = RosModel()
    if compiled is not None and compiled.robot is not None:
        model = compiled.robot.manifest.contents.of(ros2) or model
    place = {"setup": arguments.setup, "python": arguments.python}
    chosen = {name: os.path.abspath(value) for name, value in place.items() if value is not None}
    model = model.model_copy(
        update={**({"setup": "", "python": ""} if chosen else {}), **chosen}
        | ({} if arguments.domain is None else {"domain": arguments.domain})
    )
    try:
        installation = installation_of(model, os.environ)
        ran = subprocess.run(
            [installation.python, str(ROS_SIDE), "graph", str(_LOOKS)],
            env=dict(installation.environment),
            capture_output=True,
            timeout=_LOOKS + _MORE,
            check=False,
        )
    except (OutsideError, OSError, subprocess.TimeoutExpired) as error:
        raise NotDoneError(NO_ROS.at(None, f"ROS 2 does not start: {error}")) from error
    if ran.returncode:
        last = ran.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        help_text = (
            "'ros2: {python: FILE}' or '{setup: FILE}' in the manifest, or --python and --setup, say where it is"
        )
        raise NotDoneError(NO_ROS.at(None, f"ROS 2 does not start ({installation.python}): {last}", help=help_text))
    return [RosNode.of(name, found) for name, found in sorted(json.loads(ran.stdout).items())]


@dataclass(frozen=True, slots=True)
class RosNode:
    """A node of ROS 2: types by name for each of `KINDS`, without what every node has; and which topics are latched."""

    name: str
    ends: Mapping[str, Mapping[str, str]]
    latched: frozenset[str] = field(default_factory=frozenset)

    @classmethod
    def of(cls, name: str, found: Mapping[str, Any]) -> RosNode:
        """Read what ROS's side says of it; a topic with several types counts with the first."""
        ends: dict[str, dict[str, str]] = {key: {} for key in KINDS}
        for key in ("publishes", "subscribes", "serves", "calls"):
            for topic, types in found.get(key, {}).items():
                if topic.endswith(_SEND_GOAL):
                    action = types[0].replace("/action/", "/").removesuffix("_SendGoal")
                    ends[f"{key}_actions"][topic.removesuffix(_SEND_GOAL)] = action
                elif "/_action/" not in topic and not OWN.search(topic):
                    ends[key][topic] = _short(types[0])
        return cls(name, ends, frozenset(found.get("latched", ())) & ends["publishes"].keys())

    def value(self, key: str, topic: str) -> str:
        """Return what the manifest says of a topic, a service or an action."""
        type_ = self.ends[key][topic]
        return f"{{type: {type_}, qos: latched}}" if key == "publishes" and topic in self.latched else type_


def _short(name: str) -> str:
    package, _, bare = name.split("/")
    return f"{package}/{bare}"


def edits_of(node: RosNode, component: MappingNode, text: str) -> Iterator[Edit]:
    """Yield the edits that declare what a node has and its component does not; `text` is that of the file."""
    new: dict[str, dict[str, str]] = {}
    for key in KINDS:
        entry = component.entries.get(key)
        known = entry.value.entries if entry is not None and isinstance(entry.value, MappingNode) else {}
        there = {topic.strip("/") for topic in known}
        added = {
            _written(topic): node.value(key, topic) for topic in sorted(node.ends[key]) if topic.strip("/") not in there
        }
        if not added:
            continue
        if entry is not None and isinstance(entry.value, MappingNode) and known:
            yield _addition(entry.value, text, [f"{topic}: {value}" for topic, value in added.items()])
        else:
            new[key] = added
    if not new:
        return
    if _is_flow(component, text):
        inner = {key: ", ".join(f"{topic}: {value}" for topic, value in added.items()) for key, added in new.items()}
        yield _addition(component, text, [f"{key}: {{{words}}}" for key, words in inner.items()])
    else:
        lines = [
            line
            for key, added in new.items()
            for line in (f"{key}:", *(f"  {topic}: {value}" for topic, value in added.items()))
        ]
        yield _addition(component, text, lines)


def _written(topic: str) -> str:
    """Return a topic as a manifest writes it: `scan` for `/scan`, but `/tf` as it is."""
    return topic if topic in TRANSFORMS else topic.removeprefix("/")


def _is_flow(node: MappingNode, text: str) -> bool:
    line = text.split("\n")[node.span.line - 1]
    return line[node.span.column - 1 : node.span.column] == "{"


def _addition(above: MappingNode, text: str, lines: list[str]) -> Edit:
    """Return the edit that adds entries behind the last one of a map, in its style."""
    end = _end(above)
    if _is_flow(above, text):
        at = Span(end.file, end.end_line, end.end_column, end.end_line, end.end_column)
        return Edit(at, "", "".join(f", {line}" for line in lines))
    indent = " " * (next(iter(above.entries.values())).key.span.column - 1)
    column = len(text.split("\n")[end.end_line - 1]) + 1  # behind a comment
    at = Span(end.file, end.end_line, column, end.end_line, column)
    return Edit(at, "", "".join(f"\n{indent}{line}" for line in lines))


def _end(node: TreeNode) -> Span:
    """Return the place of the last thing that is written in a value: that of a block ends where the next one begins."""
    match node:
        case MappingNode() if node.entries:
            return max((_end(entry.value) for entry in node.entries.values()), key=_order)
        case SequenceNode() if node.items:
            return max(map(_end, node.items), key=_order)
    return node.span


def _order(span: Span) -> tuple[int, int]:
    return span.end_line, span.end_column
