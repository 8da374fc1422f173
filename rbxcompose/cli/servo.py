"""Find servos on a serial port, read and write them, change their ids; no manifest is needed.

Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
from importlib.util import find_spec
from pathlib import Path

from rbxcompose.actuation.servo_findings import NOT_INSTALLED
from rbxcompose.cli.bus.entities import add_json_option, add_timeout_option, count
from rbxcompose.cli.output.console import refuse
from rbxcompose.devices.port_errors import PortError

LAST_ID = 252
USUAL = (57_600, 1_000_000)  # [bit/s], at which servos are sold
_ABOUT = {
    "scan": "list the servos that answer, with their models",
    "ping": "tell which of some ids answer",
    "info": "show all values of a servo",
    "read": "read values of a servo",
    "write": "write values of a servo, raw or with a unit",
    "set-id": "give the one servo on the cable another id",
    "reboot": "start servos of protocol 2.0 again, torque off",
    "relax": "switch torque off; the next goal may switch it on",
    "disable": "switch torque off, so that no goal switches it on",
    "enable": "switch torque on; they hold where they are",
    "identify": "blink the light of a servo",
    "new-robot": "write a robot made of the servos that answer, with a joint and a controller for them",
}
_SURVEYS = ("scan", "new-robot")
_SEVERAL, _GROUPS = ("ping", "reboot", "identify"), ("relax", "disable", "enable")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="|".join(_ABOUT), required=True)
    for name, text in _ABOUT.items():
        action = actions.add_parser(name, help=text, description=text)
        action.add_argument(
            "--port", required=True, metavar="PATH", help="the serial port: /dev/ttyUSB0, usb:0403:6014"
        )
        is_survey = name in _SURVEYS
        rates = "rates to look at" if is_survey else "rate of the bus"
        default = list(USUAL) if is_survey else [USUAL[-1]]
        words = f"{rates} [bit/s] (default: {' '.join(map(str, default))})"
        action.add_argument("--baud", type=count, nargs="+" if is_survey else 1, default=default, help=words)
        action.add_argument("--protocol", type=int, choices=(1, 2), help="only this one (default: both)")
        add_timeout_option(action, "4ms")
        add_json_option(action)
        _add_own(action, name)


def _add_own(action: argparse.ArgumentParser, name: str) -> None:
    """Declare what only some actions have."""
    if name in (*_SURVEYS, *_GROUPS):
        action.add_argument("--last", type=servo_id, default=LAST_ID, metavar="ID", help="the last id to look for")
    if name == "set-id":
        action.add_argument("old", type=servo_id, metavar="OLD", help="its present id")
        action.add_argument("new", type=servo_id, metavar="NEW", help="its new id")
    elif name in _SEVERAL:
        action.add_argument("ids", type=servo_id, nargs="+", metavar="ID", help="ids of servos")
    elif name in _GROUPS:
        action.add_argument("ids", type=servo_id, nargs="*", metavar="ID", help="ids of servos")
        action.add_argument("--all", action="store_true", help="all that answer")
    elif name == "new-robot":
        action.add_argument("name", metavar="NAME", help="lower-case letters, digits, underscores")
        action.add_argument(
            "--into", metavar="DIR", type=Path, default=Path(), help="the project's folder (default: this one)"
        )
    elif name != "scan":
        action.add_argument("id", type=servo_id, metavar="ID", help="the servo's id")
    if name == "read":
        action.add_argument("items", nargs="+", metavar="ITEM", help="such as present_position")
    if name == "write":
        action.add_argument("values", nargs="+", metavar="ITEM=VALUE", help="such as led=1, goal_position='30 deg'")


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
    from rbxcompose.cli.servos.actions import ACTIONS

    try:
        return ACTIONS[arguments.action](arguments)
    except PortError as error:
        return refuse(error.finding())
