"""Carries out a change of a running robot, if a person and the robot agree."""

from __future__ import annotations

import argparse
import sys

from rbxcompose.cli.output.console import misused, refuse, tell
from rbxcompose.cli.robots.lookup import REFUSED
from rbxcompose.cli.robots.proposal import Proposal


def carry_out(proposal: Proposal, arguments: argparse.Namespace) -> int:
    """Apply a change unless the robot refuses, or a person; return the exit code."""
    name = proposal.folder.path.name
    if proposal.why_not:
        return refuse(REFUSED.at(None, f"'{name}' refuses: {proposal.why_not}"))
    if arguments.dry_run or proposal.is_empty:
        return 0
    if (problem := unsure(name, arguments)) is not None:
        return problem
    answer = proposal.apply()
    if not arguments.json:
        tell(f"{name} is changed: {answer}")
    return 0


def unsure(name: str, arguments: argparse.Namespace) -> int | None:
    """Ask a person, unless the command says it; return the exit code if nothing is to be done."""
    if arguments.yes:
        return None
    if arguments.json or not sys.stdin.isatty():
        return misused("apply", "there is no terminal to ask: give --yes, or --dry-run to only look")
    sys.stdout.write(f"change '{name}'? [y/N] ")
    sys.stdout.flush()
    if sys.stdin.readline().strip().lower() in ("y", "yes"):
        return None
    tell("nothing was changed")
    return 0
