"""Show and change what arms must not hit, and what they hold, while the robot runs.

Changes last until the robot goes down; write objects in the manifest under `scene:` to keep them.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable

from rbxcompose.cli.bus.entities import table
from rbxcompose.cli.output.console import refuse, tell, tell_report
from rbxcompose.cli.robots.commands import add_asking_options, pass_on
from rbxcompose.cli.robots.lookup import NotDoneError, answer_of, find_robot
from rbxcompose.findings import Report
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.validate import validate
from rbxcompose.scene_requests import (
    AddToScene,
    AttachInScene,
    DetachInScene,
    ListScene,
    RemoveFromScene,
    SceneEntry,
)
from rbxcompose.sections.scene import ObjectModel
from rbxcompose.typed_json import to_data

_SHOWN = "OBJECT"  # name of the object's text in findings


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="ls|add|remove|attach|detach", required=True)
    ls = actions.add_parser("ls", help="list the objects")
    ls.set_defaults(do=_ls)
    add = actions.add_parser("add", help="put an object into the scene")
    add.set_defaults(do=_add)
    remove = actions.add_parser("remove", help="take an object out of the scene")
    remove.set_defaults(do=lambda arguments: pass_on(arguments, RemoveFromScene(arguments.name)))
    attach = actions.add_parser(
        "attach",
        help="let an object move with a link, as when a gripper holds it",
        description="It stays where it is, and may touch the link and all that this carries, or the links of --touch.",
    )
    attach.set_defaults(do=_attach)
    detach = actions.add_parser("detach", help="let an object stay where it is")
    detach.set_defaults(do=lambda arguments: pass_on(arguments, DetachInScene(arguments.name)))
    for one in (add, remove, attach, detach):
        one.add_argument("name", metavar="NAME", help="the object")
    add.add_argument("object", metavar="OBJECT", help="as in a manifest: '{box: [60 cm, 40 cm, 2 cm], at: {x: 50 cm}}'")
    attach.add_argument("link", metavar="LINK", help="a link of the body, such as right_gripper_link")
    attach.add_argument("--touch", metavar="LINK", action="append", default=[], help="a link that it may touch")
    for one in (ls, add, remove, attach, detach):
        add_asking_options(one)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    do: Callable[[argparse.Namespace], int] = arguments.do
    return do(arguments)


def _ls(arguments: argparse.Namespace) -> int:
    try:
        found = answer_of(find_robot(arguments.robot), ListScene())
    except NotDoneError as error:
        return refuse(error.finding)
    if arguments.json:
        tell(json.dumps([to_data(one) for one in found]))
    elif not found:
        tell("the scene is empty")
    else:
        tell(table([("name", "shape", "size", "link", "position", "may touch"), *map(_row, found)]))
    return 0


def _row(one: SceneEntry) -> tuple[str, ...]:
    return one.name, one.shape, _lengths(one.size), one.link, _lengths(one.position), ", ".join(one.touches)


def _lengths(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value * 100:g}" for value in values) + " cm"


def _add(arguments: argparse.Namespace) -> int:
    root, findings = read_text(arguments.object, _SHOWN)
    report = Report()
    report.extend(findings)
    read = validate(ObjectModel, root, (), report) if root is not None and not findings else None
    if read is None:
        tell_report(report, {_SHOWN: arguments.object})
        return 1
    shape, pose = read.shape, read.at.to_transform()
    entry = SceneEntry(
        arguments.name, shape.kind, shape.size, read.link or "", pose.translation, pose.rotation, tuple(read.touches)
    )
    return pass_on(arguments, AddToScene(entry))


def _attach(arguments: argparse.Namespace) -> int:
    return pass_on(arguments, AttachInScene(arguments.name, arguments.link, tuple(arguments.touch)))
