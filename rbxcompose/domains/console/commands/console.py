"""Print the link to the page of a running robot, with a QR code for phones.

A page that is open to the network (`console: {listen: lan}`) is opened by links with a token for a role: `view` may
look and stop, `operate` may also drive and use everything, `configure` may also change what the robot is. Whoever has a
link has its role, until `--renew` makes all links of this user worthless.
"""

import argparse

from rbxcompose.commands.console import NotDoneError, emit
from rbxcompose.commands.lookup import REFUSED, add_robot_option, answer_of, find_robot
from rbxcompose.domains.console.access import Role, renew_secret, secret_path
from rbxcompose.domains.console.links import show_link
from rbxcompose.runtime.requests import DescribeRobot

GROUP = "look"
_ROLES = [role.word for role in Role if role is not Role.NOBODY]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_robot_option(parser)
    parser.add_argument("--role", choices=_ROLES, default=Role.OPERATE.word, help="what its visitors may (%(default)s)")
    parser.add_argument("--renew", action="store_true", help="make new tokens; `down` and `up` bring them into force")


def run(arguments: argparse.Namespace) -> int:
    """Print the link."""
    if arguments.renew:
        try:
            renew_secret()
        except OSError as error:
            raise NotDoneError(REFUSED.at(None, f"{secret_path()}: {error.strerror}")) from error
        emit("tokens are renewed: links that were given away open nothing once their robots are up again")
        return 0
    folder = find_robot(arguments.robot)
    name = folder.path.name
    for component in answer_of(folder, DescribeRobot()):
        for page in component.capabilities.get("ServesPage", ()):
            show_link(name, page["port"], is_lan=page["listen"] == "lan", role=Role[arguments.role.upper()])
            return 0
    help_text = "add 'console: {}' to its manifest"
    raise NotDoneError(REFUSED.at(None, f"'{name}' has no console", help=help_text))
