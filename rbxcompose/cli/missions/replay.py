"""`mission replay`: run missions again from their log, and report where they differ from it."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

from rbxcompose.cli.missions.files import mission_in, robot_of
from rbxcompose.cli.output.console import FINDINGS, tell
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Span, kind
from rbxcompose.missions.engine.log_replay import OtherMissionError, ReplayBudget, ReplayError, replay
from rbxcompose.missions.engine.logbook import INPUTS, LogRecord
from rbxcompose.model.robot import Robot
from rbxcompose.regular_files import TooLargeError, read_regular

_LARGEST = 16_000_000  # [B] largest log that is replayed
_MOST_VALUES = 1_500_000  # in it, as far as they are easily counted
_MOST_RUNS = 10_000
_DEEPEST = 200  # levels of lists and maps in a record, which are twice those of the values in it
_OWN = ("mission", "run")  # keys of a record that identify its run

NO_LOG = kind("RBX9041")


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
    if robot is None:
        return FINDINGS
    differs, budget = False, ReplayBudget()
    for (name, number), run in runs.items():
        found = difference(run, name, robot, arguments.log, budget)
        differs = differs or bool(found)
        tell(f"{name}, run {number}: {found or f'the same, {len(run.records)} records'}")
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
        maps = (value for one in level if isinstance(one, dict) for value in one.values())
        level = [*maps, *(value for one in level if isinstance(one, list) for value in one)]
        if not level:
            return False
    return True


def _line(file: str, number: int) -> Span:
    return Span(file, number, 1, number, 1)


def difference(run: LoggedRun, name: str, robot: Robot, file: str, budget: ReplayBudget) -> str:
    """Describe the first record that differs now; empty if all are the same."""
    then = [_told(record) for record in run.records if record["event"] not in INPUTS]
    try:
        again = replay(run.records, mission_in(robot, name), robot.names, budget)
    except OtherMissionError:
        return "the log has results of nodes that the mission does not have: it has changed too much to continue"
    except ReplayError as error:
        place = _line(file, run.lines[error.record])
        raise NotDoneError(NO_LOG.at(place, f"'{file}' cannot be replayed: {error}")) from error
    now = [_told(record) for record in json.loads(json.dumps(again))]
    for number in range(max(len(then), len(now))):
        before, after = then[number : number + 1], now[number : number + 1]
        if before != after:
            return f"differs\n  then: {_shown(before)}\n  now:  {_shown(after)}"
    return ""


def _told(record: LogRecord) -> dict[str, Any]:
    return {key: value for key, value in record.items() if key not in _OWN}


def _shown(records: Sequence[LogRecord]) -> str:
    return json.dumps(records[0]) if records else "nothing"
