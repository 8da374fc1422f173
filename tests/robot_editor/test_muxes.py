"""Who goes first at a mux, edited as a text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.requests import Refused
from tests.robot_editor.test_robot_editor import ask, editor_of, save

MUXED = """rbx: 1
kind: Robot
name: fetcher
components:
  base: {type: diff_drive_sim, max_speed: 0.5 m/s, max_turn_rate: 90 deg/s, command_timeout: 0.5 s}
  go_to: {type: go_to, speed: 0.3 m/s}
args:
  patience: {type: time, default: 1 s}
muxes:
  cmd_vel:
    inputs:
      # a person goes first
      teleop:
        priority: 100   # of 255
        timeout: 500 ms
      navigation: {from: go_to, priority: 10, timeout: "${args.patience}"}
    locks:
      door: {priority: 200, timeout: 0.3 s}
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    file = tmp_path / "robots/fetcher/robot.yaml"
    file.parent.mkdir(parents=True)
    file.write_text(MUXED, encoding="utf-8")
    return tmp_path


def ranked(**values: Any) -> dict[str, Any]:
    given = {key.replace("__", "."): value for key, value in values.items()}
    return {"op": "set", "path": ["muxes", "cmd_vel"], "values": given}


def text_of(project: Path) -> str:
    return (project / "robots/fetcher/robot.yaml").read_text(encoding="utf-8")


def test_inputs_and_locks_are_told_as_they_are_written(project: Path) -> None:
    (mux,) = ask(editor_of(project), "look", subject="muxes")["entries"]
    assert mux["has_priorities"] is True
    rows = [(row["group"], row["name"], row["priority"], row["timeout"], row["why_not"]) for row in mux["rows"]]
    assert rows == [
        ("inputs", "teleop", 100, "500 ms", ""),
        ("inputs", "navigation", 10, "1 s", ""),
        ("locks", "door", 200, "0.3 s", ""),
    ]


def test_two_priorities_change_at_once_and_comments_stay(project: Path) -> None:
    save(editor_of(project), ranked(inputs__teleop__priority=10, inputs__navigation__priority=100), subject="muxes")
    assert text_of(project) == (
        MUXED.replace("priority: 100 ", "priority: 10 ").replace("go_to, priority: 10,", "go_to, priority: 100,")
    )


def test_a_timeout_is_written_as_it_was_typed(project: Path) -> None:
    save(editor_of(project), ranked(inputs__teleop__timeout="0.25 s", locks__door__timeout="1 min"), subject="muxes")
    assert text_of(project) == MUXED.replace("500 ms", "0.25 s").replace("0.3 s}\n", "1 min}\n").replace(
        "speed: 1 min}", "speed: 0.3 m/s}"
    )


def test_what_check_finds_is_told_before_it_is_saved(project: Path) -> None:
    told = ask(editor_of(project), "look", ranked(inputs__navigation__priority=100), subject="muxes")
    assert [one["severity"] for one in told["findings"] if one["is_new"]] == ["error"]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (ranked(inputs__teleop__priority="high"), "must be a whole number"),
        (ranked(inputs__teleop__priority=1.5), "must be a whole number"),
        (ranked(inputs__teleop__priority=10**30), "must be a whole number"),
        (ranked(inputs__teleop__timeout=float("nan")), "must be a finite number"),
        (ranked(inputs__teleop__timeout="-1 s"), "must not be negative"),
        (ranked(inputs__teleop__timeout="1 m"), "must be a time"),
        (ranked(inputs__nobody__priority=1), "has no 'inputs.nobody.priority'"),
        (ranked(mode__x__priority=1), "has no"),
        (ranked(inputs__navigation__timeout="2 s"), r"computed from '\$\{args.patience\}' at "),
        *(
            ({"op": op, "path": ["muxes", "cmd_vel"], "values": {}, "name": "x"}, "only values can be changed here")
            for op in ("add", "rename", "remove")
        ),
    ],
)
def test_what_is_no_change_of_a_mux_is_refused(project: Path, change: dict[str, Any], why: str) -> None:
    with pytest.raises(Refused, match=why):
        save(editor_of(project), change, subject="muxes")
    assert text_of(project) == MUXED
