"""Show, check, draw and pose the body of a robot, or of a URDF or xacro file.

Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

from __future__ import annotations

import argparse

from rbxcompose.cli.bodies import check, expand, picture, pose, show, simplify, tree

ACTIONS = (show, tree, check, expand, picture, simplify, pose)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    for one in ACTIONS:
        one.add(actions)
    actions.metavar = "|".join(actions.choices)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen action."""
    return int(arguments.do(arguments))
