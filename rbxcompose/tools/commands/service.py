"""List the services on the bus, or call one.

The request is YAML with the fields of the service's type; missing fields are zero.
"""

import argparse

from rbxcompose.commands.guest import Guest, add_server_verbs, visit, write_names
from rbxcompose.commands.options import BUS, deferred

GROUP = "data"
ON_SYSTEM = BUS
FOR_ALL = ("ls",)
_VERB = ("call", "send a request and print the response")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_server_verbs(
        parser,
        "service",
        _VERB,
        "request",
        "/battery/set_level",
        (_ls, deferred("rbxcompose.commands.messages", "call")),
    )


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return visit(arguments, lambda guest: int(arguments.do(guest, arguments)))


def _ls(guest: Guest, arguments: argparse.Namespace) -> int:
    return write_names(guest.graph().services, ("servers", "clients"), arguments)
