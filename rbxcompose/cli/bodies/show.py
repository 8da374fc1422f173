"""`body show`."""

from __future__ import annotations

import argparse

from rbxcompose.body.description import Description
from rbxcompose.body.text import JOINTS, LINKS, extent_of, joints_of, links_of
from rbxcompose.cli.bodies.actions import Actions, add_action
from rbxcompose.cli.bus.entities import table
from rbxcompose.cli.output.console import tell


def add(actions: Actions) -> None:
    """Declare the action."""
    add_action(actions, "show", "list links and joints with masses and limits", _show)


def _show(arguments: argparse.Namespace, description: Description) -> int:
    body = description.body
    tell(f"{extent_of(body)}\n")
    tell(table([LINKS, *links_of(body)]))
    tell("")
    tell(table([JOINTS, *joints_of(body)]))
    return 0
