"""`body tree`."""

from __future__ import annotations

import argparse

from rbxcompose.body.description import Description
from rbxcompose.body.text import tree_of
from rbxcompose.cli.bodies.actions import Actions, add_action
from rbxcompose.cli.output.console import tell


def add(actions: Actions) -> None:
    """Declare the action."""
    add_action(actions, "tree", "show which link hangs on which", _tree)


def _tree(arguments: argparse.Namespace, description: Description) -> int:
    tell("\n".join(tree_of(description.body)))
    return 0
