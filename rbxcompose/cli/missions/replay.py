"""`mission replay`: run missions again from their log, and report where they differ from it."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rbxcompose.cli.missions.files import mission_in, robot_of
from rbxcompose.cli.output.console import FINDINGS, tell
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.findings import kind
from rbxcompose.missions.engine.logbook import INPUTS, LogRecord, ReplayError, replay
from rbxcompose.model.robot import Robot
from rbxcompose.regular_files import read_regular

_LARGEST = 16_000_000  # [B] largest log that is replayed
_OWN = ("mission", "run")  # keys of a record that identify its run

NO_LOG = kind(
    "RBX9041",
    """The file is not the log of a mission

`rbxcompose mission replay` reads the output of `rbxcompose mission log --all`: one JSON record per line, each run from
its start. Without `--all` the inputs are missing, and nothing can be run again.

Bad: `rbxcompose mission log > patrol.log; rbxcompose mission replay patrol.log robots/turtlebot`
Good: `rbxcompose mission log --all > patrol.log; rbxcompose mission replay patrol.log robots/turtlebot`
""",
)


def replay_log(arguments: argparse.Namespace) -> int:
    """Run all missions in a log again; the exit code is 1 if anything differs.

    Raises:
        NotDoneError: if the file is no log, or the robot lacks its missions.
    """
    runs = runs_in(arguments.log)
    robot = robot_of(arguments.path)
    if robot is None:
        return FINDINGS
    differs = False
    for (name, number), records in runs.items():
        found = difference(records, name, robot, arguments.log)
        differs = differs or bool(found)
        tell(f"{name}, run {number}: {found or f'the same, {len(records)} records'}")
    return FINDINGS if differs else 0


def runs_in(file: str) -> dict[tuple[str, int], list[LogRecord]]:
    """Return the records of a log by mission and run.

    Raises:
        NotDoneError: if it cannot be read.
    """
    runs: dict[tuple[str, int], list[LogRecord]] = {}
    try:
        for line in read_regular(Path(file), _LARGEST).decode("utf-8").splitlines():
            record = json.loads(line)
            runs.setdefault((record["mission"], record["run"]), []).append(record)
    except OSError as error:
        raise NotDoneError(NO_LOG.at(None, f"'{file}' cannot be read: {error.strerror}")) from error
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise NotDoneError(NO_LOG.at(None, f"'{file}' is not a log: each line must be a JSON record")) from error
    if not runs:
        raise NotDoneError(NO_LOG.at(None, f"'{file}' is empty"))
    return runs


def difference(records: Sequence[LogRecord], name: str, robot: Robot, file: str) -> str:
    """Describe the first record that differs now; empty if all are the same."""
    then = [_told(record) for record in records if record["event"] not in INPUTS]
    try:
        again = replay(records, mission_in(robot, name), robot.names)
    except ReplayError as error:
        raise NotDoneError(NO_LOG.at(None, f"'{file}' cannot be replayed: {error}")) from error
    except LookupError:  # a result of a leaf that no longer exists
        return "the log has results of nodes that the mission does not have: it has changed too much to continue"
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
