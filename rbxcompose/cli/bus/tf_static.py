"""`tf static`."""

from __future__ import annotations

import argparse
import sys

from rbxcompose.body.transform_errors import UnknownFrameError
from rbxcompose.cli.bus.entities import signed
from rbxcompose.cli.bus.guest import NAME, Guest
from rbxcompose.cli.bus.heard_frames import HeardFrames
from rbxcompose.cli.bus.place import BusPlace, find_place
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.findings import kind
from rbxcompose.geometry import Transform3, quaternion_from_rpy
from rbxcompose.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.printable import plain
from rbxcompose.qos import Qos
from rbxcompose.units import ANGLE, LENGTH

_TOPIC = "/tf_static"
_LONGEST = 1000  # characters of a note

NO_PLACE = kind("RBX9043")


def add_static_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the frames and the pose."""
    parser.add_argument("parent", metavar="PARENT", help="the frame in which it is placed, such as base_link")
    parser.add_argument("frame", metavar="CHILD", help="the frame to place, such as laser")
    for axis, words in (("x", "forward"), ("y", "left"), ("z", "up")):
        parser.add_argument(f"--{axis}", type=signed(LENGTH), default=0.0, metavar="20cm", help=f"{words} (default: 0)")
    for angle, axis in (("roll", "x"), ("pitch", "y"), ("yaw", "z")):
        words = f"turned about {axis} (default: 0)"
        parser.add_argument(f"--{angle}", type=signed(ANGLE), default=0.0, metavar="90deg", help=words)


def publish_static(arguments: argparse.Namespace) -> int:
    """Place a frame until an interrupt."""
    parent, child = arguments.parent, arguments.frame
    turned = quaternion_from_rpy(arguments.roll, arguments.pitch, arguments.yaw)
    pose = Transform3((arguments.x, arguments.y, arguments.z), turned)
    try:
        place = find_place(arguments)
        with Guest(place) as looking:  # through the router, which knows everyone
            frames = HeardFrames(looking)
            looking.run(lambda: frames.is_whole, arguments.timeout)
        if refusal := _refusal(frames, parent, child, pose):
            return refuse(NO_PLACE.at(None, refusal))
        return _hold(place, frames, parent, child, pose)
    except NotDoneError as error:
        return refuse(error.finding)


def _refusal(frames: HeardFrames, parent: str, child: str, pose: Transform3) -> str:
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


def _hold(place: BusPlace, frames: HeardFrames, parent: str, child: str, pose: Transform3) -> int:
    with Guest(place, stays=True) as guest, guest.interruptible():
        publisher = guest.bus(frames.kind).publisher(NAME, _TOPIC, TFMessage, Qos.LATCHED)
        link = TransformStamped(
            header=Header(stamp=to_time(guest.clock.stamp()), frame_id=parent),
            child_frame_id=child,
            transform=Transform(translation=Vector3(*pose.translation), rotation=Quaternion(*pose.rotation)),
        )
        publisher(TFMessage(transforms=(link,)))
        tell(f"'{plain(child)}' is in '{plain(parent)}'; Ctrl-C ends it")
        guest.run(lambda: guest.is_interrupted)
    return 0
