"""Show the tree of frames on the bus, or where one frame is in another; place a frame.

A frame is at its last published pose; a static one never becomes outdated.
"""

from __future__ import annotations

import argparse
import math
import sys
from functools import partial
from typing import Any

from rbxcompose.base.clock import NANOSECONDS
from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.geometry import Transform3, quaternion_from_rpy, yaw_of
from rbxcompose.base.printable import plain
from rbxcompose.base.transforms import SPAN, TransformError, TransformTree, UnknownFrameError
from rbxcompose.base.units import ANGLE, LENGTH, TIME
from rbxcompose.commands import options
from rbxcompose.commands.console import emit, refuse
from rbxcompose.commands.guest import NAME, NO_NAME, NOBODY, Guest, visit
from rbxcompose.commands.lookup import BusPlace, add_bus_options, find_place
from rbxcompose.commands.messages import shown, to_json
from rbxcompose.domains.body.command_body import ReceivedFrames
from rbxcompose.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.ports import Qos

GROUP = "bodies and arms"
ON_SYSTEM = options.BUS
FOR_ALL = ("tree",)
_DIGITS = 4  # decimal places of metres and degrees
_TOPIC = "/tf_static"
_LONGEST = 1000  # characters of a note
NO_PLACE = kind("RBX9043")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    words = (
        "where it was so long before the newest known time; it collects that long first (default: newest of each frame)"
    )
    echoed = (
        options.argument("parent", metavar="PARENT", help="the frame to look from, such as map"),
        options.argument("frame", metavar="FRAME", help="the frame to find, such as base_link"),
        options.argument("--at", type=_past, metavar="-0.5s", help=words),
        options.argument("--rate", type=options.hertz, default=1.0, metavar="1Hz", help="how often (default: 1 Hz)"),
        options.add_count_options,
    )
    shared = (partial(options.add_timeout_option, default="2s"), add_bus_options, options.add_system_options)
    place = "place CHILD in PARENT until Ctrl-C; whoever has received it keeps it"
    actions = (
        options.Subcommand("tree", "show the tree of frames", _tree, (*shared, options.add_json_option)),
        options.Subcommand(
            "echo", "print where FRAME is in PARENT", _echo, (*echoed, *shared, options.add_json_option)
        ),
        options.Subcommand("static", place, publish_static, (add_static_arguments, *shared)),
    )
    options.add_actions(parser, actions)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    if arguments.action == "static":
        return publish_static(arguments)
    return visit(arguments, lambda guest: int(arguments.do(guest, arguments)))


def _tree(guest: Guest, arguments: argparse.Namespace) -> int:
    frames = ReceivedFrames(guest)
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
        emit(to_json(found))
        return 0
    lines = list(_lines(tree, children, None, ""))
    emit("\n".join(lines or ["no frames"]))
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
    frames, parent, frame, at = ReceivedFrames(guest), arguments.parent, arguments.frame, arguments.at
    tree, past = frames.tree, -(at or 0)
    waits = arguments.timeout + (past / NANOSECONDS if past <= SPAN else 0.0)  # more is never remembered
    guest.run(lambda: _is_known(tree, parent, frame, at), waits)
    printed = 0
    while arguments.count is None or printed < arguments.count:
        if printed:
            guest.run(lambda: False, 1 / arguments.rate)
        try:
            placed = _placed(tree, parent, frame, at)
        except TransformError as problem:
            return refuse(_finding(problem, tree))
        age = tree.age(parent, frame, guest.clock.now()) or 0.0
        text = shown({**placed, "age": round(age, _DIGITS)}, arguments.json)
        emit(text if arguments.json else f"{text}\n---")
        printed += 1
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
    time = options.signed(TIME)(text)
    if time > 0:
        raise argparse.ArgumentTypeError("must not be in the future: write '-0.5s'")
    return round(time * NANOSECONDS)


def add_static_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the frames and the pose."""
    parser.add_argument("parent", metavar="PARENT", help="the frame in which it is placed, such as base_link")
    parser.add_argument("frame", metavar="CHILD", help="the frame to place, such as laser")
    for axis, words in (("x", "forward"), ("y", "left"), ("z", "up")):
        parser.add_argument(
            f"--{axis}", type=options.signed(LENGTH), default=0.0, metavar="20cm", help=f"{words} (default: 0)"
        )
    for angle, axis in (("roll", "x"), ("pitch", "y"), ("yaw", "z")):
        words = f"turned about {axis} (default: 0)"
        parser.add_argument(f"--{angle}", type=options.signed(ANGLE), default=0.0, metavar="90deg", help=words)


def publish_static(arguments: argparse.Namespace) -> int:
    """Place a frame until an interrupt."""
    parent, child = arguments.parent, arguments.frame
    turned = quaternion_from_rpy(arguments.roll, arguments.pitch, arguments.yaw)
    pose = Transform3((arguments.x, arguments.y, arguments.z), turned)
    place = find_place(arguments)
    with Guest(place) as looking:  # through the router, which knows everyone
        frames = ReceivedFrames(looking)
        looking.run(lambda: frames.is_whole, arguments.timeout)
    if refusal := _refusal(frames, parent, child, pose):
        return refuse(NO_PLACE.at(None, refusal))
    return _hold(place, frames, parent, child, pose)


def _refusal(frames: ReceivedFrames, parent: str, child: str, pose: Transform3) -> str:
    """Return why a frame cannot be placed; if it can, place it in the tree that was heard."""
    if child.startswith("/") or parent.startswith("/"):
        return "names of frames do not begin with '/'"
    before, writer = frames.tree.parent_of(child), frames.writers.get(child, "")
    if before is not None and parent != child:
        who = "another 'rbxcompose tf static'" if writer.endswith(f"/{NAME}") else writer or "an unknown node"
        return f"'{child}' is already placed in '{before}', by {who}"
    if parent not in frames.tree.frames and parent != child:
        sys.stderr.write(f"note: {plain(str(UnknownFrameError(parent, frames.tree.frames)), _LONGEST)}\n")
    answer = frames.tree.set(parent, child, pose, stamp=0.0, static=True)
    return "" if answer.accepted else answer.message


def _hold(place: BusPlace, frames: ReceivedFrames, parent: str, child: str, pose: Transform3) -> int:
    with Guest(place, stays=True) as guest, guest.interruptible():
        publisher = guest.bus(frames.kind).publisher(NAME, _TOPIC, TFMessage, Qos.LATCHED)
        link = TransformStamped(
            header=Header(stamp=to_time(guest.clock.stamp()), frame_id=parent),
            child_frame_id=child,
            transform=Transform(translation=Vector3(*pose.translation), rotation=Quaternion(*pose.rotation)),
        )
        publisher(TFMessage(transforms=(link,)))
        emit(f"'{plain(child)}' is in '{plain(parent)}'; Ctrl-C ends it")
        guest.run(lambda: guest.is_interrupted)
    return 0
