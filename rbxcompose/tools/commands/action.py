"""List the actions on the bus, or send a goal to one.

`send` prints feedback as it arrives, then the result. An interrupt cancels the goal and waits for its end, at
most for `--timeout`; a second one does not wait.
"""

import argparse

from rbxcompose.commands.guest import add_server_verbs, visit_for_action
from rbxcompose.commands.options import BUS

GROUP = "data"
ON_SYSTEM = BUS
FOR_ALL = ("ls",)
_VERB = ("send", "send a goal, print feedback and result")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_server_verbs(parser, "action", _VERB, "goal", "/go_to")


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return visit_for_action(arguments)
