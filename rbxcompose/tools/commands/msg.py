"""Show the definition of a message, service or action, or write our own as a ROS 2 package.

ROS 2 knows all types of a robot except those of the package `rbxcompose_msgs`: `msg export ros2_ws/src` writes it.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import rbxcompose
from rbxcompose.commands.console import emit, refuse
from rbxcompose.commands.messages import NO_TYPE, to_json
from rbxcompose.commands.new_files import write_new
from rbxcompose.manifest.files import shown_name
from rbxcompose.msgs.definitions import Structures, type_hash
from rbxcompose.msgs.packages import OWN, all_names, package_files, parts_of, short, whole_text

GROUP = "data"
LICENCE = "Apache-2.0"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="show|export", required=True)
    parser.set_defaults(action="show")
    show = actions.add_parser(
        "show", help="print a definition with all types that it uses, and its type hash (the default)"
    )
    show.add_argument("type", metavar="TYPE", help="such as geometry_msgs/Twist")
    export = actions.add_parser("export", help=f"write the package {OWN} for a ROS 2 workspace")
    export.add_argument("folder", metavar="DIR", type=Path, help=f"the folder in which to create {OWN}")
    for subparser in (show, export):
        subparser.add_argument("--json", action="store_true", help="answer in JSON")


def run(arguments: argparse.Namespace) -> int:
    """Show a type, or write the package."""
    if arguments.action == "export":
        return _export(arguments.folder, arguments.json)
    return _show(arguments.type, arguments.json)


def _show(wanted: str, as_json: bool) -> int:
    names = all_names()
    name = next((name for name in names if wanted in (name, short(name))), None)
    if name is None:
        words = f"unknown type '{wanted}'"
        return refuse(NO_TYPE.misspelt(None, words, wanted, [*names, *map(short, names)], "known types"))
    hashed, text = type_hash(name, Structures()), whole_text(name)
    if as_json:
        emit(to_json({"type": name, "hash": hashed, "text": text, "parts": parts_of(name)}))
    else:
        emit(f"# {name}\n# {hashed}\n{text}".rstrip("\n"))
    return 0


def _export(folder: Path, as_json: bool) -> int:
    target = folder / OWN
    finding = write_new(target, package_files(OWN, rbxcompose.__version__, LICENCE))
    if finding is not None:
        return refuse(replace(finding, help="choose another folder"))
    if as_json:
        emit(to_json({"package": OWN, "folder": str(target)}))
    else:
        emit(f"{shown_name(target)} is written; in the workspace: colcon build --packages-select {OWN}")
    return 0
