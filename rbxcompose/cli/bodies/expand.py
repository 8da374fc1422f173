"""`body expand`."""

from __future__ import annotations

import argparse
from pathlib import Path

from rbxcompose.body.description import Description
from rbxcompose.cli.bodies.actions import Actions, add_action, write
from rbxcompose.cli.output.console import tell


def add(actions: Actions) -> None:
    """Declare the action."""
    parser = add_action(actions, "expand", "print the URDF, with nothing of xacro left", _expand)
    parser.add_argument("--out", metavar="FILE", help="write it to this file")


def _expand(arguments: argparse.Namespace, description: Description) -> int:
    if arguments.out is None:
        tell(description.published.rstrip("\n"))
        return 0
    return write(Path(arguments.out), description.published.encode())
