"""`mission explore`: what could happen to a mission, and where it would hang."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from rbxcompose.cli.common.mission_files import mission_in, robot_of
from rbxcompose.cli.common.telling import FINDINGS, tell
from rbxcompose.trials.exploring import Limits, run, text_of


def explore(arguments: argparse.Namespace) -> int:
    """Explore a mission and tell what was found; the code is 1 if anything is wrong."""
    robot = robot_of(arguments.path)
    if robot is None:
        return FINDINGS
    mission_in(robot, arguments.name)
    explored = run(robot, arguments.name, Limits(arguments.states, arguments.depth))
    tell(json.dumps(asdict(explored), indent=1) if arguments.json else text_of(explored))
    return FINDINGS if explored.found else 0
