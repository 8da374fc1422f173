"""Print the link to the page of a running robot, with a QR code for phones.

A page that is open to the network (`console: {listen: lan}`) is opened by links with a token for a role: `view` may
look and stop, `operate` may also drive and use everything, `configure` may also change what the robot is. Whoever has a
link has its role, until `--renew` makes all links of this user worthless.
"""

from __future__ import annotations

import argparse
import socket
import sys

from rbxcompose.commands.console import NotDoneError, emit
from rbxcompose.commands.lookup import REFUSED, add_robot_option, answer_of, find_robot, known_state
from rbxcompose.domains.console.access import LOCAL_NAMES, Role, own_secret, renew_secret, secret_path, token_of
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.requests import DescribeRobot

GROUP = "look"
_ROLES = [role.word for role in Role if role is not Role.NOBODY]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_robot_option(parser)
    parser.add_argument("--role", choices=_ROLES, default=Role.OPERATE.word, help="what its visitors may (%(default)s)")
    parser.add_argument(
        "--renew", action="store_true", help="make new tokens; robots of this machine take them at once"
    )


def run(arguments: argparse.Namespace) -> int:
    """Print the link."""
    if arguments.renew:
        try:
            renew_secret()
        except OSError as error:
            raise NotDoneError(REFUSED.at(None, f"{secret_path()}: {error.strerror}")) from error
        emit("tokens are renewed: links that were given away open nothing any more")
        return 0
    folder = find_robot(arguments.robot)
    name = folder.path.name
    for component in answer_of(folder, DescribeRobot()):
        for page in component.capabilities.get("ServesPage", ()):
            if why := why_no_page(folder, component.name):
                raise NotDoneError(REFUSED.at(None, f"'{name}' {why}"))
            show_link(name, page["port"], is_lan=page["listen"] == "lan", role=Role[arguments.role.upper()])
            return 0
    help_text = "add 'console: {}' to its manifest"
    raise NotDoneError(REFUSED.at(None, f"'{name}' has no console", help=help_text))


def why_no_page(folder: RobotFolder, component: str) -> str:
    """Return why a component does not serve its page, such as a port that is in use; empty if it does."""
    state = known_state(folder)
    return next((each.note for each in state.components if each.name == component), "") if state else ""


def show_link(robot: str, port: int, *, is_lan: bool, role: Role = Role.OPERATE) -> None:
    """Print the link to a robot's page; one for the network has a token, and in a terminal a QR code."""
    if not is_lan:
        emit(f"console: {link(LOCAL_NAMES[0], port)}")
        return
    try:
        token = token_of(own_secret(), robot, role)
    except OSError as error:
        emit(f"console: there is no link: {secret_path()}: {error.strerror}")
        return
    address = link(network_address(), port, token)
    emit(f"console, to {role.word}: {address}")
    if sys.stdout.isatty():
        import segno  # of the extra `console`, which a robot with a page has

        segno.make(address, error="l").terminal(compact=True, border=2)


def link(host: str, port: int, token: str = "") -> str:
    """Return the address of the page; what is behind `#` is not sent by browsers, and in no log of a server."""
    return f"http://{host}:{port}/" + (f"#token={token}" if token else "")


def network_address() -> str:
    """Return the address that others in the network reach this machine by; of this machine only, if there is none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as chosen:
        try:
            chosen.connect(("192.0.2.1", 9))  # documentation's network: nothing is sent
        except OSError:
            return LOCAL_NAMES[0]
        return str(chosen.getsockname()[0])
