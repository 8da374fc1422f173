"""Give devices on USB their names: what is plugged in, entries for `devices:`, and rules of udev.

No action but `install` changes anything, and none needs root but that. Exit codes: 0 fine, 1 errors found, 2 wrong
usage.
"""

from __future__ import annotations

import argparse

from rbxcompose.cli.devices import check, generate, install, scan

ACTIONS = (scan, generate, check, install)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    for one in ACTIONS:
        one.add(actions)
    actions.metavar = "|".join(actions.choices)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen action."""
    return int(arguments.do(arguments))
