"""List the actions on the bus, or send a goal to one.

Sending prints the feedback as it comes, then the result. An interrupt cancels the goal and waits for its end; a second
one waits for nothing.
"""

from __future__ import annotations

import argparse

from rbxcompose.cli.common.bus_place import add_bus_options
from rbxcompose.cli.common.guest import Guest
from rbxcompose.cli.common.nouns import (
    add_json_option,
    add_ls_options,
    add_timeout_option,
    tell_list,
    visit,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="ls|send", required=True)
    ls = actions.add_parser("ls", help="list the actions with their types")
    add_ls_options(ls)
    ls.set_defaults(do=_ls)
    send = actions.add_parser("send", help="send a goal, print feedback and result")
    send.add_argument("name", metavar="ACTION", help="its name, such as /go_to")
    send.add_argument("goal", metavar="GOAL", nargs="?", default="", help="YAML; what it leaves out is zero")
    add_timeout_option(send, "5s")
    add_json_option(send)
    send.set_defaults(do=_send)
    for one in (ls, send):
        add_bus_options(one)


def run(arguments: argparse.Namespace) -> int:
    """Do what is asked for."""
    return visit(arguments, lambda guest: int(arguments.do(guest, arguments)))


def _ls(guest: Guest, arguments: argparse.Namespace) -> int:
    return tell_list(guest.graph().actions, ("servers", "clients"), arguments)


def _send(guest: Guest, arguments: argparse.Namespace) -> int:
    from rbxcompose.cli.common.sending import send  # what messages need would slow down the list

    return send(guest, arguments)
