"""`udev generate`."""

from __future__ import annotations

import argparse
import json

from rbxcompose.cli.devices.actions import Actions, add_action, add_group_option, devices_of
from rbxcompose.cli.output.console import FINDINGS, tell


def add(actions: Actions) -> None:
    """Declare the action."""
    add_group_option(add_action(actions, "generate", "print the rules of udev for the devices of a robot", _generate))


def _generate(arguments: argparse.Namespace) -> int:
    found = devices_of(arguments)
    if found is None or not found.is_right:
        return FINDINGS
    rules = found.rules(arguments.group)
    tell(json.dumps({"file": f"/{found.file}", "rules": rules}) if arguments.json else rules.rstrip("\n"))
    return 0
