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
from pathlib import Path

from rbxcompose.base.files import read_regular, replace_file
from rbxcompose.base.findings import Fix, apply_fixes, kind
from rbxcompose.base.requests import OutsideError
from rbxcompose.commands import options
from rbxcompose.commands.console import FINDINGS, NotDoneError, emit, write_report
from rbxcompose.commands.messages import to_json
from rbxcompose.commands.targets import add_path_argument, robot_path
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.domains.programs.bridge.installation import RosModel, installation_of
from rbxcompose.domains.programs.bridge.ros_bridge import ROS_SIDE
from rbxcompose.domains.programs.ros_nodes import KINDS, RosNode, edits_of
from rbxcompose.domains.programs.sections.ros2 import ros2
from rbxcompose.manifest.tree import FILE_BYTES, MappingNode, at

GROUP = "data"
NO_ROS = kind("RBX9051")
NO_NODE = kind("RBX9052")
_LOOKS = 6.0  # [s] at most for discovery
_MORE = 30.0  # [s] for ROS to start


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


run = options.run_action


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
