"""What people read of diagnostics, and the exit code of `diag tree`."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.commands.main import main
from rbxcompose.domains.diagnostics.commands import diag
from rbxcompose.domains.diagnostics.commands.diag import change_line, tree_lines
from rbxcompose.domains.diagnostics.requests import DiagnosticsTree, LevelChange, ListChanges, TreeLine
from rbxcompose.runtime.folder import RobotFolder

OK, WARN, ERROR, STALE = Level
TREE = DiagnosticsTree(
    12.5,
    ERROR,
    "/power: battery: Low \x1b[2Jbattery",
    (
        TreeLine("/power", "power", 0, True, ERROR, "battery: Low \x1b[2Jbattery", "", (("battery", "Low battery"),)),
        TreeLine("/power/battery", "battery", 1, False, ERROR, "Low battery", "pack 7", (("level", "9 %"),)),
        TreeLine("/power/charger", "charger", 1, False, STALE, "silent since 2.0 s"),
        TreeLine("/motion", "motion", 0, True, OK, "OK"),
    ),
    left_out=3,
    dropped=1200,
)


def test_a_tree_is_aligned_with_the_cause_beside_each_group_and_values_on_request() -> None:
    assert list(tree_lines("turtlebot", TREE, values=True)) == [
        "turtlebot    ERROR  /power: battery: Low \\x1b[2Jbattery",
        "  power      ERROR  battery: Low \\x1b[2Jbattery",
        "    battery  ERROR  Low battery",
        "      hardware_id  pack 7",
        "      level        9 %",
        "    charger  STALE  silent since 2.0 s",
        "  motion     OK",
        "3 more are on /diagnostics_agg",
        "1,200 statuses were refused; the log says why",
    ]


def test_colours_change_nothing_else_and_a_width_cuts() -> None:
    plain = list(tree_lines("turtlebot", TREE))
    coloured = list(tree_lines("turtlebot", TREE, colour=True))
    assert coloured[4] == "  motion     \x1b[32mOK\x1b[0m"
    assert len(coloured) == len(plain)
    assert all(len(line) <= 20 for line in tree_lines("turtlebot", TREE, width=20))


def test_a_change_tells_when_what_and_why() -> None:
    change = LevelChange(3, 12.5, "/power", OK, ERROR, "battery: Low battery")
    assert change_line(change, False) == "   12.50  /power  OK -> ERROR  battery: Low battery"
    assert change_line(LevelChange(4, 13.0, "/power", ERROR, OK, "OK"), False) == "   13.00  /power  ERROR -> OK"


@pytest.mark.parametrize("level", Level)
def test_the_exit_code_of_tree_is_the_level_of_the_robot(
    level: Level, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tree = DiagnosticsTree(1.0, level, "", ())
    monkeypatch.setattr(diag, "find_robot", lambda name: RobotFolder(tmp_path / "turtlebot"))
    monkeypatch.setattr(diag, "answer_of", lambda folder, request: tree)
    assert main(["diag", "tree", "--json"]) == int(level)
    told = json.loads(capsys.readouterr().out)
    assert (told["robot"], told["level"]) == ("turtlebot", level.name.lower())
    assert main(["diag"]) == int(level)
    assert capsys.readouterr().out == f"turtlebot  {level.name}\n"


def test_of_a_robot_that_is_not_up_nothing_is_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert [main(words.split()) for words in ("diag", "diag --robot lat --json", "diag history")] == [STALE, STALE, 1]
    assert json.loads(capsys.readouterr().out)["error"] == "no robot 'lat' is up"
    with pytest.raises(SystemExit):
        main(["diag", "lat"])
    assert "invalid choice: 'lat' (choose from 'tree', " in (told := capsys.readouterr().err)
    assert told.endswith("; and no robot 'lat' is up\n")


def test_the_history_of_a_group_that_is_not_there_is_refused_with_those_that_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tree = replace(TREE, left_out=0)
    monkeypatch.setattr(diag, "find_robot", lambda name: RobotFolder(tmp_path / "turtlebot"))
    monkeypatch.setattr(diag, "answer_of", lambda folder, wanted: () if isinstance(wanted, ListChanges) else tree)
    assert [main(["diag", "history", path]) for path in ("", "motion/", "/power/charger", "nosuch")] == [0, 0, 0, 1]
    assert "there is no group '/nosuch'; groups: /power, /motion" in capsys.readouterr().err
