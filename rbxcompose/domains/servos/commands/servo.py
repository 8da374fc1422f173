"""Find servos on a serial port, read and write them, change their ids; no manifest is needed.

Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from rbxcompose.commands import options
from rbxcompose.commands.console import refuse
from rbxcompose.domains.devices.serial_ports import PortError
from rbxcompose.domains.servos.bus import NOT_INSTALLED

GROUP = "bodies and arms"
LAST_ID = 252
USUAL = (57_600, 1_000_000)  # [bit/s], at which servos are sold
_SURVEYS = ("scan", "new-robot")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    last = options.argument("--last", type=servo_id, default=LAST_ID, metavar="ID", help="the last id to look for")
    id_ = options.argument("id", type=servo_id, metavar="ID", help="the servo's id")
    ids = options.argument("ids", type=servo_id, nargs="+", metavar="ID", help="ids of servos")
    group = (
        last,
        options.argument("ids", type=servo_id, nargs="*", metavar="ID", help="ids of servos"),
        options.argument("--all", action="store_true", help="all that answer"),
    )
    items = options.argument("items", nargs="+", metavar="ITEM", help="such as present_position")
    words = "such as led=1, goal_position='30 deg'"
    values = options.argument("values", nargs="+", metavar="ITEM=VALUE", help=words)
    renamed = (
        options.argument("old", type=servo_id, metavar="OLD", help="its present id"),
        options.argument("new", type=servo_id, metavar="NEW", help="its new id"),
    )
    robot = (
        last,
        options.argument("name", metavar="NAME", help="lower-case letters, digits, underscores"),
        options.argument(
            "--into", metavar="DIR", type=Path, default=Path(), help="the project's folder (default: this one)"
        ),
    )
    made = "write a robot made of the servos that answer, with a joint and a controller for them"
    table: tuple[tuple[str, str, tuple[options.Declare, ...]], ...] = (
        ("scan", "list the servos that answer, with their models", (last,)),
        ("ping", "report which of some ids answer", (ids,)),
        ("info", "show all values of a servo", (id_,)),
        ("read", "read values of a servo", (id_, items)),
        ("write", "write values of a servo, raw or with a unit", (id_, values)),
        ("set-id", "give the one servo on the cable another id", renamed),
        ("reboot", "start servos of protocol 2.0 again, torque off", (ids,)),
        ("relax", "switch torque off; the next goal may switch it on", group),
        ("disable", "switch torque off, so that no goal switches it on", group),
        ("enable", "switch torque on; they hold where they are", group),
        ("identify", "blink the light of a servo", (ids,)),
        ("new-robot", made, robot),
    )
    actions = (
        options.Subcommand(name, text, _carried_out, (partial(_add_bus, is_survey=name in _SURVEYS), *own), text)
        for name, text, own in table
    )
    options.add_actions(parser, actions)


def _add_bus(action: argparse.ArgumentParser, *, is_survey: bool) -> None:
    """Declare where the servos are."""
    action.add_argument("--port", required=True, metavar="PATH", help="the serial port: /dev/ttyUSB0, usb:0403:6014")
    rates = "rates to look at" if is_survey else "rate of the bus"
    default = list(USUAL) if is_survey else [USUAL[-1]]
    words = f"{rates} [bit/s] (default: {' '.join(map(str, default))})"
    action.add_argument("--baud", type=options.count, nargs="+" if is_survey else 1, default=default, help=words)
    action.add_argument("--protocol", type=int, choices=(1, 2), help="only this one (default: both)")
    options.add_timeout_option(action, "4ms")
    options.add_json_option(action)


def servo_id(text: str) -> int:
    """Read the id of a servo."""
    if not text.isdecimal() or int(text) > LAST_ID:
        raise argparse.ArgumentTypeError(f"'{text}' is not an id of 0 to {LAST_ID}")
    return int(text)


def run(arguments: argparse.Namespace) -> int:
    """Do what was chosen with the servos on the port."""
    if find_spec("dynamixel_sdk") is None:
        help_text = "install it with: pip install 'rbxcompose[servos]'"
        return refuse(NOT_INSTALLED.at(None, "the package 'dynamixel-sdk' is not installed", help=help_text))
    try:
        return options.run_action(arguments)
    except PortError as error:
        return refuse(error.finding())


def _carried_out(arguments: argparse.Namespace) -> int:
    from rbxcompose.domains.servos.command_actions import ACTIONS  # the package of the protocol

    return ACTIONS[arguments.action](arguments)
