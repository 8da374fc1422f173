"""List the services on the bus, or call one.

The request is YAML with the fields of the service's type; missing fields are zero.
"""

import argparse

from rbxcompose.commands.guest import add_server_verbs, visit_for_action
from rbxcompose.commands.options import BUS

GROUP = "data"
ON_SYSTEM = BUS
FOR_ALL = ("ls",)
_VERB = ("call", "send a request and print the response")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_server_verbs(parser, "service", _VERB, "request", "/battery/set_level")


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return visit_for_action(arguments)
