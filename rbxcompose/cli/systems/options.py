"""Options of verbs that reach the hosts of a system; apart from what runs there, which takes longer to import."""

from __future__ import annotations

import argparse


def add_system_options(parser: argparse.ArgumentParser) -> None:
    """Declare what verbs need for the hosts of a system."""
    parser.add_argument("--ssh-config", metavar="FILE", help="of a system: ssh's configuration, instead of the user's")
