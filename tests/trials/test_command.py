"""The command `test`, and the tests of the missions that ship."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from rbxcompose.cli.main import main as command
from tests.conftest import ROOT
from tests.trials.trying import Trying

PATROL = "missions/tests/patrol.test.yaml"


def test_all_tests_of_the_missions_pass(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["test", "--json"]) == 0, capsys.readouterr().out
    told = json.loads(capsys.readouterr().out)
    assert len(told["tests"]) == len(list((ROOT / "missions").rglob("*.test.yaml"))) >= 5
    assert all(test["passed"] for test in told["tests"])


def test_the_mission_runs_alone_in_milliseconds(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    took = []
    for _ in range(3):
        assert command(["test", "--json", PATROL]) == 0
        took += [test["milliseconds"] for test in json.loads(capsys.readouterr().out)["tests"]]
    assert min(took) < 50


def test_a_filter_chooses_by_name(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["test", "missions", "--filter", "after_a_stop"]) == 0
    out = capsys.readouterr().out
    assert "1 passed" in out
    assert "goes_on_after_a_stop" in out
    assert command(["test", "missions", "--filter", "nothing_like_that"]) == 2


def test_traces_coverage_and_junit(repository: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "out.xml"
    assert command(["test", PATROL, "-v", "--coverage", "--junit", str(file)]) == 0
    out = capsys.readouterr().out
    assert "interrupt battery_low" in out
    assert "patrol: 4 of 7 ways taken" in out
    suite = ElementTree.parse(file).getroot().find("testsuite")
    assert suite is not None
    assert suite.attrib["failures"] == "0"


def test_a_failure_and_a_mistake_are_exit_code_1(trying: Trying, capsys: pytest.CaptureFixture[str]) -> None:
    trying.read("mocks:\n  go_to: failure\nexpect:\n  outcome: success\n", "states")
    path = trying.folder / "tried.test.yaml"
    assert command(["test", str(path)]) == 1
    assert "expected outcome success" in capsys.readouterr().out
    trying.read("mocks:\n  go: failure\nexpect:\n  outcome: success\n", "states")
    assert command(["test", str(path)]) == 1
    assert "RBX4201" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["no_such_folder"], ["robots"], [PATROL, "--filter"]])
def test_wrong_usage_is_exit_code_2(repository: Path, words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    try:
        code = command(["test", *words])
    except SystemExit as exit_:
        code = exit_.code  # type: ignore[assignment]
    assert code == 2
    assert capsys.readouterr().err


def test_a_mission_is_explored(repository: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["mission", "explore", "patrol", "robots/turtlebot", "--states", "100"]) == 0
    assert "can end with failure" in capsys.readouterr().out
    assert command(["mission", "explore", "patrol", "robots/turtlebot", "--depth", "9", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["found"] == []
    assert 0 < told["deepest"] <= 9
    assert command(["mission", "explore", "patrl", "robots/turtlebot"]) == 1
    assert "did you mean 'patrol'?" in capsys.readouterr().err


def test_check_takes_a_test(repository: Path, trying: Trying, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["check", PATROL]) == 0
    assert "the test recharges_and_resumes is fine" in capsys.readouterr().out
    trying.read("mocks:\n  go: failure\nexpect:\n  outcome: success\n", "states")
    assert command(["check", str(trying.folder / "tried.test.yaml")]) == 1
    assert "RBX4201" in capsys.readouterr().out
