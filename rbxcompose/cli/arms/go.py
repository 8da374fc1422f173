"""`arm go`: moves an arm of a robot that runs."""

from __future__ import annotations

import argparse
import json
from typing import Any

from rbxcompose.cli.arms.chosen import read_joints
from rbxcompose.cli.arms.written import keys_of, read_written
from rbxcompose.cli.bodies.arm_models import KeepModel, TraceModel
from rbxcompose.cli.bus.entities import add_json_option, add_timeout_option, visit, wanted
from rbxcompose.cli.bus.guest import Guest
from rbxcompose.cli.bus.place import add_bus_options
from rbxcompose.cli.output.console import misused
from rbxcompose.units import ANGLE, LENGTH

_WAY = "points"  # the key of a way; all others are joints


def add_go_options(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `arm go`."""
    parser.add_argument("arm", metavar="ARM", help="the arm")
    words = "a pose by name, '{JOINT: POSITION, ...}', or a way of the tip: '{points: [{x: 5 cm}]}'"
    parser.add_argument("goal", metavar="GOAL", help=words)
    parser.set_defaults(do=run_go)
    add_timeout_option(parser, "5s")
    add_json_option(parser)
    add_bus_options(parser)


def run_go(arguments: argparse.Namespace) -> int:
    """Send the goal, and print how it ends."""
    from rbxcompose.cli.bus.action_send import send  # the imports for messages would slow down the others

    is_way = _WAY in keys_of(arguments.goal)
    if is_way and arguments.keep:
        return misused("arm go", "--keep is not for a way of the tip: 'keep_orientation' is a key of that")
    way = read_written(TraceModel, arguments.goal).message() if is_way else None
    arguments.name = f"{arguments.arm}/{'trace' if is_way else 'move'}"

    def do(guest: Guest) -> int:
        arguments.content = json.dumps(_move(guest, arguments) if way is None else way)
        return send(guest, arguments)

    return visit(arguments, do)


def _move(guest: Guest, arguments: argparse.Namespace) -> dict[str, Any]:
    """Return a goal of `MoveArm`.

    Raises:
        NotDoneError: if it is none, or nothing tells which joints turn and which slide.
    """
    keep = read_written(KeepModel, arguments.keep or "{}").message()
    if not arguments.goal.startswith("{"):
        return {"pose": arguments.goal, "keep": keep}
    from rbxcompose.cli.bodies.heard_body import DESCRIPTION, described, described_body

    action = wanted([one for one in guest.graph().actions if one.givers], arguments.name, "action")
    namespace = action.name.removesuffix(f"/{arguments.name.lstrip('/')}")
    body = described_body(guest, described(guest, f"{namespace}/{DESCRIPTION}"), arguments.timeout)
    dimensions = {joint.name: LENGTH if joint.slides else ANGLE for joint in body.moving}
    positions = read_joints(arguments.goal, dimensions)
    return {"joints": list(positions), "positions": list(positions.values()), "keep": keep}
