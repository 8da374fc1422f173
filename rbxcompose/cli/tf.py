"""Show the tree of frames on the bus, or where one frame is in another; place a frame.

A frame is at its last published pose; a static one never becomes outdated.
"""

from __future__ import annotations

import argparse
import math
from typing import Any

from rbxcompose.body.pose_history import SPAN
from rbxcompose.body.transform_errors import TransformError, UnknownFrameError
from rbxcompose.body.transforms import TransformTree
from rbxcompose.cli.bus.entities import (
    NO_NAME,
    NOBODY,
    add_count_options,
    add_json_option,
    add_timeout_option,
    hertz,
    signed,
    visit,
)
from rbxcompose.cli.bus.guest import Guest
from rbxcompose.cli.bus.heard_frames import HeardFrames
from rbxcompose.cli.bus.messages import shown, to_json
from rbxcompose.cli.bus.place import add_bus_options
from rbxcompose.cli.bus.tf_static import add_static_arguments, publish_static
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.systems.options import BUS, add_system_options
from rbxcompose.clock import NANOSECONDS
from rbxcompose.findings import Finding
from rbxcompose.geometry import Transform3, yaw_of
from rbxcompose.printable import plain
from rbxcompose.units import TIME

ON_SYSTEM = BUS
_DIGITS = 4  # decimal places of metres and degrees


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="tree|echo|static", required=True)
    tree = actions.add_parser("tree", help="show the tree of frames")
    tree.set_defaults(do=_tree)
    echo = actions.add_parser("echo", help="print where FRAME is in PARENT")
    echo.add_argument("parent", metavar="PARENT", help="the frame to look from, such as map")
    echo.add_argument("frame", metavar="FRAME", help="the frame to find, such as base_link")
    words = (
        "where it was so long before the newest known time; it collects that long first (default: newest of each frame)"
    )
    echo.add_argument("--at", type=_past, metavar="-0.5s", help=words)
    echo.add_argument("--rate", type=hertz, default=1.0, metavar="1Hz", help="how often (default: 1 Hz)")
    add_count_options(echo)
    echo.set_defaults(do=_echo)
    static = actions.add_parser("static", help="place CHILD in PARENT until Ctrl-C; who has heard of it keeps it there")
    add_static_arguments(static)
    for one in (tree, echo, static):
        add_timeout_option(one, "2s")
        add_bus_options(one)
        add_system_options(one)
    for one in (tree, echo):
        add_json_option(one)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    if arguments.action == "static":
        return publish_static(arguments)
    return visit(arguments, lambda guest: int(arguments.do(guest, arguments)))


def _tree(guest: Guest, arguments: argparse.Namespace) -> int:
    frames = HeardFrames(guest)
    guest.run(lambda: frames.is_whole, arguments.timeout)
    tree = frames.tree
    children: dict[str | None, list[str]] = {}
    for frame in sorted(tree.frames):
        children.setdefault(tree.parent_of(frame), []).append(frame)
    if arguments.json:
        found = [
            {"frame": frame, "parent": parent, **_placed(tree, parent, frame)}
            for parent, below in children.items()
            if parent is not None
            for frame in below
        ]
        tell(to_json(found))
        return 0
    lines = list(_lines(tree, children, None, ""))
    tell("\n".join(lines or ["no frames"]))
    return 0


def _lines(tree: TransformTree, children: dict[str | None, list[str]], parent: str | None, indent: str) -> list[str]:
    """Return a line for each frame below `parent`, with its pose; it uses a stack, since a chain may be long."""
    lines: list[str] = []
    waiting = [(frame, indent) for frame in reversed(children.get(parent, []))]
    while waiting:
        frame, space = waiting.pop()
        lines.append(f"{space}{plain(frame)}{_words(tree, tree.parent_of(frame), frame)}")
        waiting += [(child, f"{space}  ") for child in reversed(children.get(frame, []))]
    return lines


def _words(tree: TransformTree, parent: str | None, frame: str) -> str:
    if parent is None:
        return ""
    placed = _placed(tree, parent, frame)
    x, y, z = placed["translation"]
    kind = "static" if placed["is_static"] else "moving"
    return f"  ({kind}: x {x:g} m, y {y:g} m, z {z:g} m, yaw {placed['yaw']:g} deg)"


def _placed(tree: TransformTree, parent: str, frame: str, at: int | None = None) -> dict[str, Any]:
    transform = _pose(tree, parent, frame, at)
    return {
        "translation": [round(value, _DIGITS) for value in transform.translation],
        "rotation": list(transform.rotation),
        "yaw": round(math.degrees(yaw_of(transform.rotation)), _DIGITS),
        "is_static": tree.stamp_of(parent, frame) == math.inf,
    }


def _pose(tree: TransformTree, parent: str, frame: str, at: int | None) -> Transform3:
    """Return the newest pose, or the one `at` [ns] after the newest time for which all between them is known.

    Raises:
        TransformError: if there is none.
    """
    if problem := tree.problem(parent, frame):
        raise problem
    if at is None:
        return tree.lookup(parent, frame) or Transform3()
    return tree.lookup_at(parent, frame, (tree.newest_common(parent, frame) or 0) + at)


def _echo(guest: Guest, arguments: argparse.Namespace) -> int:
    frames, parent, frame, at = HeardFrames(guest), arguments.parent, arguments.frame, arguments.at
    tree, past = frames.tree, -(at or 0)
    waits = arguments.timeout + (past / NANOSECONDS if past <= SPAN else 0.0)  # more is never remembered
    guest.run(lambda: _is_known(tree, parent, frame, at), waits)
    told = 0
    while arguments.count is None or told < arguments.count:
        if told:
            guest.run(lambda: False, 1 / arguments.rate)
        try:
            placed = _placed(tree, parent, frame, at)
        except TransformError as problem:
            return refuse(_finding(problem, tree))
        age = tree.age(parent, frame, guest.clock.now()) or 0.0
        text = shown({**placed, "age": round(age, _DIGITS)}, arguments.json)
        tell(text if arguments.json else f"{text}\n---")
        told += 1
    return 0


def _is_known(tree: TransformTree, parent: str, frame: str, at: int | None) -> bool:
    try:
        _pose(tree, parent, frame, at)
    except TransformError:
        return False
    return True


def _finding(problem: TransformError, tree: TransformTree) -> Finding:
    if isinstance(problem, UnknownFrameError):
        name = problem.frame
        return NO_NAME.misspelt(None, f"there is no frame '{name}'", name, tree.frames, "frames")
    return NOBODY.at(None, str(problem))


def _past(text: str) -> int:
    """Read `-0.5s` [ns]."""
    time = signed(TIME)(text)
    if time > 0:
        raise argparse.ArgumentTypeError("must not be in the future: write '-0.5s'")
    return round(time * NANOSECONDS)
