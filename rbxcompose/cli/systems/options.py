"""Options of verbs that reach the hosts of a system; apart from what runs there, which takes longer to import."""

from __future__ import annotations

import argparse

EACH, BUS = "each host", "bus"
"""What a verb may have as `ON_SYSTEM`: where it runs for a robot of a system. On each host of the robot, or on any one
that reaches its bus; any other word is the type of the component that answers."""


def add_system_options(parser: argparse.ArgumentParser, *, has_profile: bool = False) -> None:
    """Declare what verbs need for the hosts of a system; a verb with layers of robots has `--profile` already."""
    if not has_profile:
        parser.add_argument(
            "--profile", action="append", default=[], metavar="P", help="of a system: apply this profile"
        )
    parser.add_argument("--ssh-config", metavar="FILE", help="of a system: ssh's configuration, instead of the user's")
