"""`replay --into`: run one component of a recorded run again, and compare its outputs with the recording."""

from __future__ import annotations

import argparse
import json
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rbxcompose.cli.output.console import refuse, tell, tell_report
from rbxcompose.cli.project.robot_options import compiled
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.config import HIDDEN
from rbxcompose.findings import suggest
from rbxcompose.plan.dump import PlanTextError, dump, load
from rbxcompose.plan.model import Instance, Plan
from rbxcompose.printable import plain
from rbxcompose.recording.codes import DIFFERENT, NOT_ENOUGH, UNWRITABLE
from rbxcompose.recording.files import write_problem
from rbxcompose.recording.message import Recorded
from rbxcompose.recording.reader import RecordingReader
from rbxcompose.recording.recorder import Recorder
from rbxcompose.recording.tape import PLAN
from rbxcompose.regular_files import open_regular
from rbxcompose.replay.comparison import RunDifference
from rbxcompose.replay.run import ReplayResult, missing_topics, replayed

HOW = "'rbxcompose up PATH --rate max --record FILE' records everything that is needed"


def run_again(arguments: argparse.Namespace, path: Path, reader: RecordingReader) -> int:
    """Run the component that `--into` names and report the first difference; return 0 if there is none.

    Raises:
        NotDoneError: if the recording lacks something needed, or the outputs cannot be written.
    """
    deque(reader.messages(), maxlen=0)  # the index of a truncated recording has no attachments
    plan = _plan(arguments, path, reader)
    instance = _instance(plan, arguments.into)
    if missing := missing_topics(plan, instance, reader.topics):
        names = plain(", ".join(missing))
        raise NotDoneError(NOT_ENOUGH.at(None, f"'{plain(str(path))}' lacks inputs of '{instance.name}': {names}"))
    with open_regular(path) as file, _kept(arguments.write) as keep:
        found = replayed(plan, instance, RecordingReader(file).messages(), keep)
    return _told(arguments, instance.name, found)


def _plan(arguments: argparse.Namespace, path: Path, reader: RecordingReader) -> Plan:
    if PLAN not in reader.attachments:
        message = f"'{plain(str(path))}' was not recorded within a stepped run"
        raise NotDoneError(NOT_ENOUGH.at(None, message, help=HOW))
    if arguments.robot is not None:
        compilation = compiled(arguments.robot, arguments)
        tell_report(compilation.report, compilation.sources)
        if compilation.plan is None:
            raise NotDoneError(NOT_ENOUGH.at(None, f"'{plain(arguments.robot)}' has errors"))
        return compilation.plan
    try:
        return load(reader.attachments[PLAN].decode())
    except ValueError as error:
        reason = str(error) if isinstance(error, PlanTextError) else "its plan is not text"
        raise NotDoneError(NOT_ENOUGH.at(None, f"'{plain(str(path))}': {plain(reason)}")) from error


def _instance(plan: Plan, name: str) -> Instance:
    instance = next((one for one in plan.instances if one.name == name), None)
    if instance is None:
        names = [one.name for one in plan.instances]
        message = f"the robot '{plain(plan.robot)}' has no component '{plain(name, 60)}'"
        raise NotDoneError(NOT_ENOUGH.at(None, message, help=suggest(name, names, "components")))
    if HIDDEN in _settings(plan, instance):
        message = f"'{name}' has a secret, which a recording does not hold"
        raise NotDoneError(NOT_ENOUGH.at(None, message, help="'--robot PATH' takes it from the robot's file"))
    return instance


def _settings(plan: Plan, instance: Instance) -> list[object]:
    """Return the values of a recorded configuration."""
    whole = json.loads(dump(Plan(plan.robot, plan.file, (instance,))))
    left: list[object] = [whole["instances"][0]["config"]]
    found: list[object] = []
    while left:
        one = left.pop()
        if isinstance(one, dict):
            left += one.values()
        elif isinstance(one, list):
            left += one
        else:
            found.append(one)
    return found


@contextmanager
def _kept(path: Path | None) -> Iterator[Callable[[Recorded], None] | None]:
    """Yield a function that takes the outputs, and write them to a file if one is requested."""
    if path is None:
        yield None
        return
    if problem := write_problem(path):
        raise NotDoneError(UNWRITABLE.at(None, problem))
    try:
        recorder = Recorder(path, 0.0)
        yield recorder.add
        recorder.finish()
    except OSError as error:
        reason = plain(error.strerror or str(error))
        raise NotDoneError(UNWRITABLE.at(None, f"'{plain(str(path))}' cannot be written: {reason}")) from error


def _told(arguments: argparse.Namespace, name: str, found: ReplayResult) -> int:
    for text in found.errors:
        tell(plain(text))
    if arguments.json:
        tell(json.dumps({"component": name, "equal": found.equal, "difference": _fields(found.difference)}))
    elif found.difference is None:
        tell(f"'{name}' sends the same as recorded: {found.equal:,} messages")
    else:
        return refuse(DIFFERENT.at(None, _text(name, found.difference, found.equal)))
    return 0 if found.difference is None else 1


def _text(name: str, one: RunDifference, equal: int) -> str:
    where = f", field '{plain(one.field)}'" if one.field else ""
    values = f"recorded {plain(one.recorded)}, now {plain(one.now)}"
    return f"'{name}' differs at {one.time:.3f} s on {plain(one.topic)}{where}: {values}; {equal:,} messages were equal"


def _fields(one: RunDifference | None) -> dict[str, object] | None:
    if one is None:
        return None
    return {"time": one.time, "topic": one.topic, "field": one.field, "recorded": one.recorded, "now": one.now}
