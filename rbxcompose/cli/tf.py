"""Show the tree of frames on the bus, or where one frame is in another.

A frame is at its last published pose; a static one never becomes outdated.
"""

from __future__ import annotations

import argparse
import math
from typing import Any

from rbxcompose.body.transforms import TransformTree
from rbxcompose.bus.graph import GraphName
from rbxcompose.cli.bus.entities import (
    NO_NAME,
    NOBODY,
    add_count_options,
    add_json_option,
    add_timeout_option,
    hertz,
    visit,
)
from rbxcompose.cli.bus.guest import Guest, HeardMessage
from rbxcompose.cli.bus.messages import shown, to_json
from rbxcompose.cli.bus.place import add_bus_options
from rbxcompose.cli.bus.topic_echo import EchoReader
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.geometry import Transform3, yaw_of
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.printable import plain

_TOPICS = ("/tf", "/tf_static")
_DIGITS = 4  # decimal places of metres and degrees


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="tree|echo", required=True)
    tree = actions.add_parser("tree", help="show the tree of frames")
    tree.set_defaults(do=_tree)
    echo = actions.add_parser("echo", help="print where FRAME is in PARENT")
    echo.add_argument("parent", metavar="PARENT", help="the frame to look from, such as map")
    echo.add_argument("frame", metavar="FRAME", help="the frame to find, such as base_link")
    echo.add_argument("--rate", type=hertz, default=1.0, metavar="1Hz", help="how often (default: 1 Hz)")
    add_count_options(echo)
    echo.set_defaults(do=_echo)
    for one in (tree, echo):
        add_timeout_option(one, "2s")
        add_json_option(one)
        add_bus_options(one)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return visit(arguments, lambda guest: int(arguments.do(guest, arguments)))


class _Frames:
    """The tree as received so far."""

    def __init__(self, guest: Guest) -> None:
        self.tree = TransformTree()
        self._guest = guest
        self._topics = [one for one in guest.graph().topics if one.name.endswith(_TOPICS)]
        self._waiting = {end.gid for topic in self._topics for end in topic.givers}
        for topic in self._topics:
            self._listen(topic)

    @property
    def is_whole(self) -> bool:
        """Return whether something has been received from every publisher."""
        return not self._waiting

    def _listen(self, topic: GraphName) -> None:
        reader, is_static = EchoReader(topic), topic.name.endswith("_static")
        self._guest.listen(topic, lambda heard: self._heard(reader, heard, is_static))

    def _heard(self, reader: EchoReader, heard: HeardMessage, is_static: bool) -> None:
        self._waiting.discard(heard.sender)
        message = reader.read(heard)
        for link in message.transforms if isinstance(message, TFMessage) else ():
            moved, turned = link.transform.translation, link.transform.rotation
            transform = Transform3((moved.x, moved.y, moved.z), (turned.x, turned.y, turned.z, turned.w))
            self.tree.set(link.header.frame_id, link.child_frame_id, transform, stamp=heard.time, static=is_static)


def _tree(guest: Guest, arguments: argparse.Namespace) -> int:
    frames = _Frames(guest)
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


def _placed(tree: TransformTree, parent: str, frame: str) -> dict[str, Any]:
    transform = tree.lookup(parent, frame) or Transform3()
    return {
        "translation": [round(value, _DIGITS) for value in transform.translation],
        "rotation": list(transform.rotation),
        "yaw": round(math.degrees(yaw_of(transform.rotation)), _DIGITS),
        "is_static": tree.stamp_of(parent, frame) == math.inf,
    }


def _echo(guest: Guest, arguments: argparse.Namespace) -> int:
    frames, parent, frame = _Frames(guest), arguments.parent, arguments.frame
    if not guest.run(lambda: frames.tree.lookup(parent, frame) is not None, arguments.timeout):
        known = frames.tree.frames
        for name in (parent, frame):
            if name not in known:
                return refuse(NO_NAME.misspelt(None, f"there is no frame '{name}'", name, known, "frames"))
        return refuse(NOBODY.at(None, f"'{parent}' and '{frame}' are not connected"))
    told = 0
    while arguments.count is None or told < arguments.count:
        if told:
            guest.run(lambda: False, 1 / arguments.rate)
        placed = _placed(frames.tree, parent, frame)
        age = frames.tree.age(parent, frame, guest.clock.now()) or 0.0
        text = shown({**placed, "age": round(age, _DIGITS)}, arguments.json)
        tell(text if arguments.json else f"{text}\n---")
        told += 1
    return 0
