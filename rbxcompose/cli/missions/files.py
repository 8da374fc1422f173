"""Missions in files: their pictures, and the skills that they may use."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rbxcompose.cli.bus.entities import table
from rbxcompose.cli.output.console import FINDINGS, refuse, tell, tell_report
from rbxcompose.cli.project.robot_choice import only_path
from rbxcompose.cli.robots.lookup import NotDoneError, answer_of, known_state, robots_up
from rbxcompose.compiler import compile_robot
from rbxcompose.executive.requests import ListMissions, LookAtAll
from rbxcompose.findings import kind, suggest
from rbxcompose.inspection.layout import NotDrawnError
from rbxcompose.inspection.mission_graphs import mission_dot, mission_mermaid
from rbxcompose.inspection.mission_html import mission_html
from rbxcompose.inspection.mission_text import mission_text
from rbxcompose.missions.program.program import Skill
from rbxcompose.missions.program.sources import SkillSource, SkillWay
from rbxcompose.missions.program.statuses import IDLE, NAMES
from rbxcompose.missions.view.mirror import joined, status_list
from rbxcompose.missions.view.picture import MissionPicture, picture_from_data, picture_of
from rbxcompose.model.robot import Robot
from rbxcompose.model.skills import python_skills
from rbxcompose.sdk.skills import skill_names
from rbxcompose.units import example

FORMATS = {"text": mission_text, "mermaid": mission_mermaid, "dot": mission_dot, "html": mission_html}
USAGE = 2
_SAMPLES: Mapping[str, str] = {"TEXT": "hello", "FLAG": "true", "COUNT": "2", "PLACE": "dock", "POSE": "dock"}

NO_MISSION = kind("RBX9040")


def robot_of(path: str | None) -> Robot | None:
    """Compile a robot; if it has mistakes, report them and return None.

    Without a path it is the running one, else the only one of this folder.

    Raises:
        NotDoneError: if no path is given and it is not clear which robot to use.
    """
    if path is None:
        path = _running_file() or only_path(may_run=False)
    out = compile_robot(path, environment=os.environ)
    tell_report(out.report, out.sources)
    return None if out.report.has_errors else out.robot


def _running_file() -> str | None:
    found = robots_up()
    state = known_state(found[0]) if len(found) == 1 else None
    return state.file if state is not None else None


def show(arguments: argparse.Namespace) -> int:
    """Write the picture of a mission; without a path, that of the running robot, with the state of each node."""
    try:
        picture, statuses = (None if arguments.path else _live(arguments.name)) or (None, ())
        if picture is None:
            robot = robot_of(arguments.path)
            if robot is None:
                return FINDINGS
            picture = picture_of(mission_in(robot, arguments.name), robot.names)
        text = FORMATS[arguments.format](picture, statuses)
    except (NotDoneError, NotDrawnError) as error:
        return refuse(error.finding)
    if arguments.out is None:
        tell(text.rstrip("\n"))
        return 0
    try:
        Path(arguments.out).write_text(text, encoding="utf-8")
    except OSError as error:
        sys.stderr.write(f"rbxcompose mission show: '{arguments.out}' cannot be written: {error.strerror}\n")
        return USAGE
    return 0


def _live(name: str) -> tuple[MissionPicture, Sequence[int]] | None:
    """Return the picture of a mission that has been running, and the states or outcomes of its nodes."""
    if len(found := robots_up()) != 1:
        return None
    folder = found[0]
    if not any(one.name == name and one.state != NAMES[IDLE] for one in answer_of(folder, ListMissions())):
        return None
    seen = answer_of(folder, LookAtAll(name))
    picture = picture_from_data(seen["picture"])
    return picture, status_list(joined({}, seen), picture.count)


def mission_in(robot: Robot, name: str) -> Any:
    """Return the program of a robot's mission.

    Raises:
        NotDoneError: if there is none of this name.
    """
    if name not in robot.missions:
        message = f"robot '{robot.manifest.name}' has no mission '{name}'"
        raise NotDoneError(NO_MISSION.at(None, message, help=suggest(name, robot.missions, "missions of this robot")))
    return robot.missions[name].program


def skills(arguments: argparse.Namespace) -> int:
    """List all skills that a robot's missions may use."""
    try:
        robot = robot_of(arguments.path)
    except NotDoneError as error:
        return refuse(error.finding)
    if robot is None:
        return FINDINGS
    found = dict(sorted({**{one.skill.name: one for one in python_skills(skill_names())}, **robot.skills}.items()))
    if arguments.json:
        tell(json.dumps([_data(one) for one in found.values()]))
        return 0
    rows = [(name, _arguments(one.skill), _ends(one.skill), one.skill.claims, _how(one)) for name, one in found.items()]
    tell(table([("skill", "arguments", "ends", "claims", "is"), *rows]))
    tell("\n" + "\n".join(f"- {_example(one.skill)}" for one in found.values()))
    return 0


def _arguments(skill: Skill) -> str:
    told = [f"{name}{'' if name in skill.required else '?'}: {one.detail}" for name, one in skill.arguments.items()]
    return ", ".join(told) or "none"


def _ends(skill: Skill) -> str:
    own = [f"{name} ({counts})" for name, counts in skill.outcomes.items()]
    return ", ".join(["success", "failure", *own])


def _how(source: SkillSource) -> str:
    words = [f"{source.way} {source.topic}" if source.way is not SkillWay.PYTHON else "Python"]
    words += [] if source.skill.restartable else ["cannot be restarted"]
    return ", ".join([*words, *(["can pause"] if source.skill.pausable else [])])


def _example(skill: Skill) -> str:
    """Return a line of a mission that uses the skill."""
    if skill.entries:
        name, measured = next(iter(skill.entries.each.items()))
        return f"{skill.name}: {{{name}: {example(measured)}}}"
    if not skill.main:
        return skill.name
    main = skill.arguments[skill.main]
    if main.dimension:
        return f"{skill.name}: {example(main.dimension)}"
    return f"{skill.name}: {main.choices[0] if main.choices else _SAMPLES.get(main.kind.name, '...')}"


def _data(source: SkillSource) -> dict[str, Any]:
    skill = source.skill
    arguments = [
        {
            "name": name,
            "type": one.detail,
            "needed": name in skill.required,
            "main": name == skill.main,
        }
        for name, one in skill.arguments.items()
    ]
    return {
        "name": skill.name,
        "arguments": arguments,
        "outcomes": dict(skill.outcomes),
        "results": {name: one.detail for name, one in skill.results.items()},
        "claims": skill.claims,
        "restartable": skill.restartable,
        "pausable": skill.pausable,
        "way": str(source.way),
        "topic": source.topic,
        "example": _example(skill),
    }
