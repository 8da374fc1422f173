"""`mission replay`: a log runs again as it was, and what was changed since is told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.commands import main as command
from rbxcompose.missions.execution.requests import ReadLog
from rbxcompose.testing import Bench, check_file
from rbxcompose.tools import mission_files as replaying

HEAD = "rbx: 1\nkind: Mission\nname: work\n"
WORK = HEAD + "do:\n  - wait_for: $battery < 99 %\n  - log: low\n  - wait: 2 s\n  - say: done\n"
ROBOT = """
rbx: 1
kind: Robot
name: worker
values: {battery: battery.battery_level}
components: {battery: {type: battery_sim, runtime: 100 s}}
missions: {work: work.yaml}
start: work
"""


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The log of a mission, beside its robot, in the current folder."""
    monkeypatch.chdir(tmp_path)
    Path("robot.yaml").write_text(ROBOT)
    Path("work.yaml").write_text(WORK)
    plan = check_file(Path("robot.yaml")).compilation.plan
    assert plan is not None
    robot = Bench(plan=plan)
    robot.advance(10.0)
    mission: Any = robot.component("mission")
    records = mission.handle(ReadLog()).records
    Path("work.log").write_text("".join(f"{json.dumps(record)}\n" for record in records))
    return Path("work.log")


def told(capsys: pytest.CaptureFixture[str], *, code: int) -> str:
    assert command.main(["mission", "replay", "work.log", "robot.yaml"]) == code
    found = capsys.readouterr()
    return found.out + found.err


def test_a_log_runs_again_as_it_was(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert told(capsys, code=0).startswith("work, run 1: the same, ")


def test_another_mission_is_told_with_the_first_difference(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("work.yaml").write_text(WORK.replace("log: low", "log: very low"))
    text = told(capsys, code=1)
    assert "work, run 1: differs" in text
    assert '"text": "low"' in text.splitlines()[1]
    assert '"text": "very low"' in text.splitlines()[2]


def test_a_mission_without_the_nodes_of_the_log_is_told(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("work.yaml").write_text(f"{HEAD}do:\n  wait: 1 h\n")
    assert "it has changed too much to continue" in told(capsys, code=1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "'work.log' is empty"),
        ("no json\n", "'work.log' is not a log: each line must be a JSON record"),
        ("[1]\n", "'work.log' is not a log"),
        ('{"mission": "work", "run": 1, "event": "tick", "time": 1.0}\n', "does not start with the start"),
        ('{"mission": "wrok", "run": 1, "event": "tick", "time": 1.0}\n', "did you mean 'work'?"),
    ],
)
def test_what_is_no_log_of_the_robot_is_told(
    text: str, words: str, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log.write_text(text)
    assert words in told(capsys, code=1)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("time", "x", "'time' is not a time in seconds"),
        ("results", 5, "'results' is not a list"),
        ("results", [[1, {"Place": {"name": 1}}]], "a value of the type 'Place' has the fields name, x, y, heading"),
        ("read", [], "'read' is not a map"),
        ("read", {"value battery": {"Wrong": {}}}, "a value cannot be a map with the key 'Wrong'"),
    ],
)
def test_a_wrong_field_is_told_with_its_line(
    field: str, value: object, words: str, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = log.read_text().splitlines()
    at = next(number for number, line in enumerate(lines) if '"tick"' in line)
    lines[at] = json.dumps({**json.loads(lines[at]), field: value})
    log.write_text("\n".join(lines))
    text = told(capsys, code=1)
    assert f"cannot be replayed: {words}" in text
    assert f"--> work.log:{at + 1}:1" in text


@pytest.mark.parametrize(
    ("did", "words"),
    [
        (None, "cannot be replayed: '' is not known here"),
        ({"type": "ForceResult", "node": "x", "succeeds": True}, "cannot be replayed: 'node' is not a whole number"),
        ({"type": "ForceResult", "node": 99, "succeeds": True}, "cannot repeat what was done at"),
        ({"type": "ChangeData", "name": "nothing", "value": 1}, "the mission has no data 'nothing'"),
        ({"type": "SetBreakpoints", "starts": [0, 99], "ends": []}, "the mission has no such node"),
        ({"type": "JumpToState", "machine": 0, "state": "x"}, "has no state 'x'"),
    ],
)
def test_what_people_did_is_checked_before_it_is_repeated(
    did: object, words: str, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = log.read_text().splitlines()
    at = next(number for number, line in enumerate(lines) if '"tick"' in line) + 1
    record = json.loads(lines[at - 1])
    lines.insert(
        at, json.dumps({key: record[key] for key in ("time", "mission", "run")} | {"event": "intervene", "did": did})
    )
    log.write_text("\n".join(lines))
    assert words in told(capsys, code=1)


@pytest.mark.parametrize(
    ("limit", "words"), [("_MOST_RUNS", "has more than 0 runs"), ("_MOST_VALUES", "it holds more than 0 values")]
)
def test_a_log_beyond_the_limits_is_refused(
    limit: str, words: str, log: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replaying, limit, 0)
    assert words in told(capsys, code=1)


def test_a_record_of_many_levels_is_no_record(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log.write_text(log.read_text() + '{"mission": "work", "run": 1, "event": "a", "x": ' + "[" * 400 + "]" * 400 + "}")
    assert "is not a log" in told(capsys, code=1)
