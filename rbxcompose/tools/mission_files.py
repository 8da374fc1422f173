"""Missions in files: their pictures, the skills that they may use, their logs again, and their exploration."""

import argparse
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, field, replace
from pathlib import Path
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.files import TooLargeError, read_regular
from rbxcompose.base.findings import Span, kind, suggest
from rbxcompose.base.requests import Refused
from rbxcompose.base.units import example
from rbxcompose.commands.console import FINDINGS, NotDoneError, ReportedError, emit, misused, table, write_report
from rbxcompose.commands.lookup import REFUSED, answer_of, known_state, robots_up
from rbxcompose.commands.options import unsaved_of
from rbxcompose.commands.targets import put_robot_last, robot_path, without_errors
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.model.skills import usable_skills
from rbxcompose.manifest.files import shown_name
from rbxcompose.missions.engine.inputs import bind_texts
from rbxcompose.missions.engine.logbook import (
    INPUTS,
    LogRecord,
    OtherInterventionError,
    OtherMissionError,
    ReplayBudget,
    ReplayError,
    replay,
)
from rbxcompose.missions.execution.requests import ListMissions, LookAtAll, settings
from rbxcompose.missions.program.outcomes import IDLE, NAMES
from rbxcompose.missions.program.program import Skill
from rbxcompose.missions.sources import SkillSource, SkillWay
from rbxcompose.missions.view.picture import MissionPicture, picture_from_data, picture_of
from rbxcompose.missions.view.replica import joined, status_list
from rbxcompose.tools.inspection.mission_text import mission_dot, mission_mermaid, mission_sentences, mission_text
from rbxcompose.tools.inspection.pages import mission_html
from rbxcompose.tools.mission_tests.explorer import ExplorationLimits, text_of
from rbxcompose.tools.mission_tests.explorer import explore as explore_program

FORMATS = {
    "text": mission_sentences,
    "tree": mission_text,
    "mermaid": mission_mermaid,
    "dot": mission_dot,
    "html": mission_html,
}
_SAMPLES: Mapping[str, str] = {"TEXT": "hello", "FLAG": "true", "COUNT": "2", "PLACE": "dock", "POSE": "dock"}
NO_MISSION = kind("RBX9040")
_LARGEST = 16_000_000  # [B] largest log that is replayed
_MOST_VALUES = 1_500_000  # in it, as far as they are easily counted
_MOST_RUNS = 10_000
_DEEPEST = 200  # levels of lists and maps in a record, which are twice those of the values in it
_OWN = ("mission", "run", "step")  # keys of a record that tell of which run and which node it is
NO_LOG = kind("RBX9041")


def robot_of(path: str | None) -> Robot:
    """Compile a robot, and report its findings.

    Without a path it is the running one, else the only one of this folder.

    Raises:
        NotDoneError: if no path is given and it is not clear which robot to use.
        ReportedError: if it has errors.
    """
    if path is None:
        found = robots_up()
        state = known_state(found[0]) if len(found) == 1 else None
        path = state.file if state is not None else robot_path(None, may_run=False)
    robot, _ = without_errors(compile_robot(path, environment=os.environ))
    return robot


def show(arguments: argparse.Namespace) -> int:
    """Write the picture of a mission; without a path, that of the running robot, with the state of each node."""
    put_robot_last(arguments, "name")
    picture, statuses = (None if arguments.path else _live(arguments.name)) or (None, ())
    if picture is None:
        robot = robot_of(arguments.path)
        picture = picture_of(mission_in(robot, arguments.name), robot.names)
    text = FORMATS[arguments.format](picture, statuses)
    if arguments.out is None:
        emit(text.rstrip("\n"))
        return 0
    try:
        Path(arguments.out).write_text(text, encoding="utf-8")
    except OSError as error:
        return misused("mission show", f"'{arguments.out}' cannot be written: {error.strerror}")
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
    robot = robot_of(arguments.path)
    found = usable_skills(robot)
    if arguments.json:
        emit(json.dumps([_data(entry) for entry in found.values()]))
        return 0
    rows = [
        (name, _arguments(entry.skill), _ends(entry.skill), entry.skill.claims, _how(entry))
        for name, entry in found.items()
    ]
    emit(table([("skill", "arguments", "ends", "claims", "is"), *rows]))
    emit("\n" + "\n".join(f"- {example_step(entry.skill)}" for entry in found.values()))
    return 0


def _arguments(skill: Skill) -> str:
    listed = [f"{name}{'' if name in skill.required else '?'}: {one.detail}" for name, one in skill.arguments.items()]
    return ", ".join(listed) or "none"


def _ends(skill: Skill) -> str:
    own = [f"{name} ({counts})" for name, counts in skill.outcomes.items()]
    return ", ".join(["success", "failure", *own])


def _how(source: SkillSource) -> str:
    words = [f"{source.way} {source.topic}" if source.way is not SkillWay.PYTHON else "Python"]
    words += [] if source.skill.restartable else ["cannot be restarted"]
    return ", ".join([*words, *(["can pause"] if source.skill.pausable else [])])


def example_step(skill: Skill) -> str:
    """Return a step of a mission that uses the skill."""
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
        {"name": name, "type": argument.detail, "needed": name in skill.required, "main": name == skill.main}
        for name, argument in skill.arguments.items()
    ]
    return {
        "name": skill.name,
        "arguments": arguments,
        "outcomes": dict(skill.outcomes),
        "results": {name: result.detail for name, result in skill.results.items()},
        "claims": skill.claims,
        "restartable": skill.restartable,
        "pausable": skill.pausable,
        "way": str(source.way),
        "topic": source.topic,
        "example": example_step(skill),
    }


@dataclass(slots=True)
class LoggedRun:
    """The records of one run of a mission, and the line of each in the file."""

    records: list[LogRecord] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)


def replay_log(arguments: argparse.Namespace) -> int:
    """Run all missions in a log again; the exit code is 1 if anything differs.

    Raises:
        NotDoneError: if the file is no log, or the robot lacks its missions.
    """
    runs = runs_in(arguments.log)
    robot = robot_of(arguments.path)
    differs, budget = False, ReplayBudget()
    for (name, number), run in runs.items():
        found = difference(run, name, robot, arguments.log, budget)
        differs = differs or bool(found)
        emit(f"{name}, run {number}: {found or f'the same, {len(run.records)} records'}")
    return FINDINGS if differs else 0


def runs_in(file: str) -> dict[tuple[str, int], LoggedRun]:
    """Return the records of a log by mission and run.

    Raises:
        NotDoneError: if it cannot be read.
    """
    runs: dict[tuple[str, int], LoggedRun] = {}
    number = 0
    try:
        for number, line in enumerate(_text_of(file).splitlines(), 1):
            record = json.loads(line)
            run = runs.setdefault(_run_of(record, line), LoggedRun())
            run.records.append(record)
            run.lines.append(number)
    except OSError as error:
        raise NotDoneError(NO_LOG.at(None, f"'{file}' cannot be read: {error.strerror}")) from error
    except (ValueError, RecursionError) as error:
        message = f"'{file}' is not a log: each line must be a JSON record of a run"
        raise NotDoneError(NO_LOG.at(_line(file, number) if number else None, message)) from error
    if not runs:
        raise NotDoneError(NO_LOG.at(None, f"'{file}' is empty"))
    if len(runs) > _MOST_RUNS:
        raise NotDoneError(NO_LOG.at(None, f"'{file}' has more than {_MOST_RUNS:,} runs; replay a part of it"))
    return runs


def _text_of(file: str) -> str:
    data = read_regular(Path(file), _LARGEST)
    if data.count(b",") + data.count(b"[") + data.count(b"{") > _MOST_VALUES:
        raise TooLargeError(0, f"it holds more than {_MOST_VALUES:,} values")
    return data.decode("utf-8")


def _run_of(record: object, line: str) -> tuple[str, int]:
    """Return which run a record belongs to; raise ValueError if it is no record, or none that a log can have."""
    if not isinstance(record, dict):
        raise ValueError("no record")
    mission, run = record.get("mission"), record.get("run")
    if type(mission) is not str or type(run) is not int or type(record.get("event")) is not str:
        raise ValueError("no record")
    if len(line) > _DEEPEST and line.count("[") + line.count("{") > _DEEPEST and _is_deep(record):
        raise ValueError("too deep")
    return mission, run


def _is_deep(record: object) -> bool:
    level: list[Any] = [record]
    for _ in range(_DEEPEST):
        maps = (value for map_ in level if isinstance(map_, dict) for value in map_.values())
        level = [*maps, *(value for map_ in level if isinstance(map_, list) for value in map_)]
        if not level:
            return False
    return True


def _line(file: str, number: int) -> Span:
    return Span(file, number, 1, number, 1)


def difference(run: LoggedRun, name: str, robot: Robot, file: str, budget: ReplayBudget) -> str:
    """Describe the first record that differs now; empty if all are the same."""
    then = [_without_run(record) for record in run.records if record["event"] not in INPUTS]
    try:
        again = replay(run.records, mission_in(robot, name), robot.names, budget)
    except OtherMissionError:
        return "the log has results of nodes that the mission does not have: it has changed too much to continue"
    except OtherInterventionError as error:
        did = run.records[error.record]
        return f"cannot repeat what was done at {did['time']:g} s: {error}\n  then: {json.dumps(did.get('did', ''))}"
    except ReplayError as error:
        place = _line(file, run.lines[error.record])
        raise NotDoneError(NO_LOG.at(place, f"'{file}' cannot be replayed: {error}")) from error
    now = [_without_run(record) for record in json.loads(json.dumps(again))]
    for number in range(max(len(then), len(now))):
        before, after = then[number : number + 1], now[number : number + 1]
        if before != after:
            return f"differs\n  then: {_shown(before)}\n  now:  {_shown(after)}"
    return ""


def _without_run(record: LogRecord) -> dict[str, Any]:
    return {key: value for key, value in record.items() if key not in _OWN}


def _shown(records: Sequence[LogRecord]) -> str:
    return json.dumps(records[0]) if records else "nothing"


def explore(arguments: argparse.Namespace) -> int:
    """Explore a mission and report the findings; the exit code is 1 if anything is wrong."""
    put_robot_last(arguments, "name")
    robot = robot_of(arguments.path)
    program = mission_in(robot, arguments.name)
    try:
        inputs = _inputs(robot, arguments.name, settings(arguments.sets))
    except Refused as refusal:
        return misused("mission explore", str(refusal))
    explored = explore_program(program, robot.names, inputs, ExplorationLimits(arguments.states, arguments.depth))
    emit(json.dumps(asdict(explored), indent=1) if arguments.json else text_of(explored))
    return FINDINGS if explored.found else 0


def try_(arguments: argparse.Namespace) -> int:
    """Run a mission on the simulated robot and the stepped clock; write its story, and what came of it."""
    from rbxcompose.tools.mission_editor.dry_run import dry_run  # the bench takes time to import

    put_robot_last(arguments, "name")
    path = arguments.path or robot_path(None, may_run=False)
    out = compile_robot(path, environment=os.environ, unsaved=unsaved_of(arguments))
    if out.robot is not None and arguments.name in out.robot.manifest.missions:
        file = out.robot.manifest.missions[arguments.name].path
        try:
            tried = dry_run(out, arguments.name, file, out.sources.get(shown_name(file), ""))
        except Refused as refusal:
            if not out.report.has_errors:
                raise NotDoneError(REFUSED.at(None, f"'{arguments.name}' is not run: {refusal}")) from refusal
        else:
            emit(json.dumps(tried, ensure_ascii=False) if arguments.json else _story(tried))
            return 0
    write_report(out.report, out.sources)
    if out.robot is not None and not out.report.has_errors:
        mission_in(out.robot, arguments.name)
    raise ReportedError


def _story(tried: Mapping[str, Any]) -> str:
    """Return a dry run for people: a line for each event, and the end."""
    left = [f"{tried['left_out']} lines before these are left out"] if tried["left_out"] else []
    lines = [f"{line['time']:8.2f}  {line['text']}" for line in tried["story"]]
    end = f"{tried['outcome'] or 'still running'} after {tried['time']:.2f} s"
    return "\n".join([*left, *lines, ": ".join(filter(None, (end, tried["why"])))])


def _inputs(robot: Robot, name: str, given: Mapping[str, str]) -> Mapping[str, Value]:
    """Return the inputs of a mission; `given` ones override the robot's. Raise NotDoneError if one is missing."""
    mission = robot.missions[name]
    inputs, findings = bind_texts(mission.program, given, mission.inputs, robot.manifest.places)
    if findings:
        help_text = findings[0].help if given else "give inputs by '--set NAME=VALUE'"
        raise NotDoneError(replace(findings[0], span=None, help=help_text))
    return inputs
