"""`body pose`."""

from __future__ import annotations

import argparse

from rbxcompose.cli.bodies.actions import Actions
from rbxcompose.cli.bus.entities import add_timeout_option, seconds
from rbxcompose.cli.bus.place import add_bus_options

_ABOUT = "move the joints of a running robot, by sliders in the terminal or with --joint"
_MORE = """It reads `robot_description` from the bus; it publishes `joint_states` ten times a second and at each change.

Sliders: up and down select a joint. Left and right move it by 1 deg or 1 cm, with shift, or page up and down, by ten
of these. 0, c and r move it to zero, to the centre of its range, or anywhere; Z, C and R do so with all. q quits."""


def add(actions: Actions) -> None:
    """Declare the action."""
    parser = actions.add_parser("pose", help=_ABOUT, description=f"{_ABOUT[:1].upper()}{_ABOUT[1:]}.\n\n{_MORE}")
    parser.add_argument("name", nargs="?", metavar="ROBOT|PATH", help="the robot, by name or file")
    words = "publish this position and end: 0.6 (rad or m), '35 deg', '5 cm'; no terminal is needed"
    parser.add_argument("--joint", action="append", default=[], metavar="NAME=POSITION", help=words)
    words = "publish the positions of --joint for this long (default: once)"
    parser.add_argument("--duration", type=seconds, metavar="T", help=words)
    parser.add_argument("--topic", metavar="TOPIC", help="the topic with the URDF (default: robot_description)")
    add_timeout_option(parser, "2s")
    add_bus_options(parser)
    parser.set_defaults(do=_pose)


def _pose(arguments: argparse.Namespace) -> int:
    from rbxcompose.cli.bodies.live_pose import pose  # imports the bus, which no other action needs

    return pose(arguments)
