"""`mission explore`: what could happen in a mission, and where it would hang."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import asdict, replace

from rbxcompose.cli.missions.files import mission_in, robot_of
from rbxcompose.cli.output.console import FINDINGS, misused, tell
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.executive.requests import settings
from rbxcompose.expressions.values import Value
from rbxcompose.mission_tests.explorer import ExplorationLimits, text_of
from rbxcompose.mission_tests.explorer import explore as explore_program
from rbxcompose.missions.engine.inputs import bind_texts
from rbxcompose.model.robot import Robot
from rbxcompose.requests import Refused


def explore(arguments: argparse.Namespace) -> int:
    """Explore a mission and report the findings; the exit code is 1 if anything is wrong."""
    robot = robot_of(arguments.path)
    if robot is None:
        return FINDINGS
    program = mission_in(robot, arguments.name)
    try:
        inputs = _inputs(robot, arguments.name, settings(arguments.sets))
    except Refused as refusal:
        return misused("mission explore", str(refusal))
    explored = explore_program(program, robot.names, inputs, ExplorationLimits(arguments.states, arguments.depth))
    tell(json.dumps(asdict(explored), indent=1) if arguments.json else text_of(explored))
    return FINDINGS if explored.found else 0


def _inputs(robot: Robot, name: str, given: Mapping[str, str]) -> Mapping[str, Value]:
    """Return the inputs of a mission; `given` ones override the robot's. Raise NotDoneError if one is missing."""
    mission = robot.missions[name]
    inputs, findings = bind_texts(mission.program, given, mission.inputs, robot.manifest.places)
    if findings:
        help_text = findings[0].help if given else "give inputs by '--set NAME=VALUE'"
        raise NotDoneError(replace(findings[0], span=None, help=help_text))
    return inputs
