"""List the services on the bus, or call one.

The request is YAML with the fields of the service's type; what is left out is zero.
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
    actions = parser.add_subparsers(dest="action", metavar="ls|call", required=True)
    ls = actions.add_parser("ls", help="list the services with their types")
    add_ls_options(ls)
    ls.set_defaults(do=_ls)
    call = actions.add_parser("call", help="send a request and print the response")
    call.add_argument("service", metavar="SERVICE", help="its name, such as /battery/set_level")
    call.add_argument("request", metavar="REQUEST", nargs="?", default="", help="YAML; what it leaves out is zero")
    add_timeout_option(call, "5s")
    add_json_option(call)
    call.set_defaults(do=_call)
    for one in (ls, call):
        add_bus_options(one)


def run(arguments: argparse.Namespace) -> int:
    """Do what is asked for."""
    return visit(arguments, lambda guest: int(arguments.do(guest, arguments)))


def _ls(guest: Guest, arguments: argparse.Namespace) -> int:
    return tell_list(guest.graph().services, ("servers", "clients"), arguments)


def _call(guest: Guest, arguments: argparse.Namespace) -> int:
    from rbxcompose.cli.common.calling import call  # what messages need would slow down the list

    return call(guest, arguments)
