"""Show the body of a robot: its links and joints, their tree, the expanded URDF, or a picture.

Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from rbxcompose.atomic_files import replace_file
from rbxcompose.body.description import Description
from rbxcompose.body.model import Body
from rbxcompose.body.picture import NoPictureError, draw
from rbxcompose.body.text import JOINTS, LINKS, joints_of, links_of, tree_of
from rbxcompose.cli.bus.entities import table
from rbxcompose.cli.output.console import FINDINGS, refuse, tell, tell_report
from rbxcompose.cli.project.robot_options import add_layer_options, layers_of
from rbxcompose.compiler import compile_robot
from rbxcompose.findings import kind

USAGE = 2
NO_BODY = kind(
    "RBX2008",
    """The robot has no body

`body` commands show what the section `body` of a robot names.

Bad: `rbxcompose body show robots/turtlebot`, whose file has no `body`.
Good:
```yaml
body:
  urdf: robot.urdf
```
""",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="show|tree|expand|picture", required=True)
    for name, do, text in (
        ("show", _show, "list links and joints with masses and limits"),
        ("tree", _tree, "show which link hangs on which"),
        ("expand", _expand, "print the URDF, with nothing of xacro left"),
        ("picture", _picture, "draw it as a PNG"),
    ):
        action = actions.add_parser(name, help=text, description=text)
        action.add_argument("path", metavar="PATH", help="the robot's file, its folder, or rbx:robots/NAME")
        add_layer_options(action)
        action.set_defaults(do=do)
        if name == "expand":
            action.add_argument("--out", metavar="FILE", help="write it to this file")
        if name == "picture":
            action.add_argument("--out", metavar="FILE", help="the picture (default: NAME.png)")
            action.add_argument(
                "--joint", action="append", default=[], metavar="NAME=POSITION", help="a joint's position [rad or m]"
            )


def run(arguments: argparse.Namespace) -> int:
    """Compile the robot and do what was chosen with its body."""
    compilation = compile_robot(arguments.path, **layers_of(arguments))
    tell_report(compilation.report, compilation.sources)
    description = compilation.robot.manifest.body if compilation.robot else None
    if description is None or not description.body.links:
        return FINDINGS if compilation.report.has_errors else refuse(NO_BODY.at(None, "this robot has no body"))
    return int(arguments.do(arguments, description)) or (FINDINGS if compilation.report.has_errors else 0)


def _show(arguments: argparse.Namespace, description: Description) -> int:
    body = description.body
    mass = sum(link.inertial.mass for link in body.links.values() if link.inertial)
    tell(f"{len(body.links)} links, {len(body.moving)} joints that move, {mass:.4g} kg\n")
    tell(table([LINKS, *links_of(body)]))
    tell("")
    tell(table([JOINTS, *joints_of(body)]))
    return 0


def _tree(arguments: argparse.Namespace, description: Description) -> int:
    tell("\n".join(tree_of(description.body)))
    return 0


def _expand(arguments: argparse.Namespace, description: Description) -> int:
    if arguments.out is None:
        tell(description.text.rstrip("\n"))
        return 0
    return _written(Path(arguments.out), description.text.encode())


def _picture(arguments: argparse.Namespace, description: Description) -> int:
    body, file = description.body, Path(arguments.out or f"{description.body.name or 'body'}.png")
    try:
        positions = dict(_position(body, written) for written in arguments.joint)
        picture = draw(body, positions, description.meshes)
    except ValueError as error:
        sys.stderr.write(f"rbxcompose body: {error}\n")
        return USAGE
    except NoPictureError as error:
        return refuse(error.finding)
    return _written(file, picture)


def _position(body: Body, written: str) -> tuple[str, float]:
    name, _, value = written.partition("=")
    if name not in {joint.name for joint in body.moving}:
        raise ValueError(f"there is no moving joint '{name}': {', '.join(joint.name for joint in body.moving)}")
    try:
        position = float(value)
    except ValueError:
        position = math.nan
    if not math.isfinite(position):
        raise ValueError(f"the position of '{name}' must be a number [rad or m], not '{value}'")
    return name, position


def _written(file: Path, content: bytes) -> int:
    """Write a file and say so; return the exit code."""
    try:
        replace_file(file.resolve(), content)
    except OSError as error:
        sys.stderr.write(f"rbxcompose body: '{file}' cannot be written: {error.strerror}\n")
        return USAGE
    tell(f"wrote {file}")
    return 0
