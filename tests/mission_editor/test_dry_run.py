"""Dry runs: the text as it is typed, on the simulated robot, without a trace on the one that is up."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.tools.mission_editor import dry_run
from rbxcompose.tools.mission_editor.editor import MissionEditor
from tests.mission_editor.test_editor import FETCH, ROBOT, ask, editor, project

__all__ = ["editor", "project"]


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a dry run end after a few seconds: what it does then is the same."""
    assert dry_run.LONGEST == 600.0
    monkeypatch.setattr(dry_run, "LONGEST", 30.0)


def test_a_text_runs_on_the_simulated_robot_and_tells_its_story(editor: MissionEditor) -> None:
    told = ask(editor, "try", text=FETCH.replace("wait: 2 s", "log: there"))
    assert (told["outcome"], told["why"]) == ("success", "")
    assert any("there" in line["text"] for line in told["story"])
    assert told["statuses"] == [{"path": ["do", index], "status": "success"} for index in (0, 1)]


def test_a_run_can_be_played_again(editor: MissionEditor) -> None:
    told = ask(editor, "try", text=FETCH)
    assert [(one["path"], one["status"]) for one in told["changes"]] == [
        (["do", 0], "running"),
        (["do", 0], "success"),
        (["do", 1], "running"),
        (["do", 1], "success"),
    ]
    times = [one["time"] for one in told["changes"]]
    assert times == sorted(times)
    (_, first, *_), (time, last, *_) = told["track"][0], told["track"][-1]
    assert first < 0.1
    assert abs(last - 1.0) < 0.1  # the table
    assert time <= told["time"]
    assert [place["name"] for place in told["places"]] == ["dock", "table"]


def test_a_run_that_has_ended_becomes_a_test_which_passes(editor: MissionEditor, project: Path) -> None:
    made = ask(editor, "test_new")
    assert made == {"file": "missions/tests/fetch.test.yaml"}
    text = (project / made["file"]).read_text(encoding="utf-8")
    assert "robot: ../../robots/fetcher/robot.yaml\n" in text
    assert text.endswith("expect:\n  outcome: success\n  steps:\n    - go_to: table\n      ended: success\n")
    report = ask(editor, "test", text=FETCH)
    assert [one["passed"] for one in report["tests"]] == [True]
    with pytest.raises(Refused, match="exists"):
        ask(editor, "test_new")


@pytest.mark.soak
def test_a_test_that_was_made_of_a_run_fails_where_another_one_ends_so(editor: MissionEditor) -> None:
    ask(editor, "test_new")
    assert ask(editor, "test", text=FETCH.replace("table", "dock"))["tests"][0]["passed"] is False


@pytest.mark.usefixtures("short")
def test_a_run_that_goes_on_becomes_no_test(editor: MissionEditor, project: Path) -> None:
    (project / "missions/fetch.yaml").write_text(FETCH.replace("2 s", "2 h"), encoding="utf-8")
    with pytest.raises(Refused, match="a test needs a run that has ended"):
        ask(editor, "test_new")
    assert not (project / "missions/tests").exists()


def test_a_step_that_fails_and_one_that_is_not_reached_are_told_apart(editor: MissionEditor) -> None:
    told = ask(editor, "try", text=FETCH.replace("wait: 2 s", "check: 1 > 2") + "  - wait: 1 s\n")
    assert told["outcome"] == "failure"
    assert [one["status"] for one in told["statuses"]] == ["success", "failure"]


@pytest.mark.usefixtures("short")
def test_a_mission_that_does_not_end_is_ended(editor: MissionEditor) -> None:
    told = ask(editor, "try", text=FETCH.replace("wait: 2 s", "wait: 2 h"))
    assert (told["outcome"], told["why"]) == ("", "it has not ended after 30 s of robot time")
    assert told["statuses"][-1] == {"path": ["do", 1], "status": "running"}


def test_a_mission_with_errors_does_not_run(editor: MissionEditor) -> None:
    with pytest.raises(Refused, match="there is no place 'tabel'"):
        ask(editor, "try", text=FETCH.replace("table ", "tabel "))


def test_a_mission_whose_input_has_no_value_does_not_run(editor: MissionEditor) -> None:
    with pytest.raises(Refused, match="the input 'where' of the mission 'fetch' needs a value; a 'default' would do"):
        ask(editor, "try", text=f"{FETCH}\ninputs: {{where: {{type: place}}}}\n")


def test_a_robot_that_starts_programs_is_not_tried(editor: MissionEditor, project: Path) -> None:
    robot = project / "robots/fetcher/robot.yaml"
    robot.write_text(f"{ROBOT}components:\n  other: {{type: program, command: [sleep, '1']}}\n", encoding="utf-8")
    with pytest.raises(Refused, match="'other' would start a program"):
        ask(editor, "try", text=FETCH)


@pytest.mark.soak
def test_the_tests_of_a_mission_run_with_coverage(editor: MissionEditor, project: Path) -> None:
    with pytest.raises(Refused, match="there are no tests of 'fetch'"):
        ask(editor, "test", text=FETCH)
    test = "rbx: 1\nkind: Test\nname: it_fetches\nrobot: ../robots/fetcher/robot.yaml\nmission: fetch\n"
    test += "expect:\n  outcome: success\n"
    (project / "missions/fetch.test.yaml").write_text(test, encoding="utf-8")
    told = ask(editor, "test", text=FETCH)
    assert [(one["passed"], one["problems"]) for one in told["tests"]] == [(True, [])]
    assert told["coverage"]["ways"] > told["coverage"]["taken"] > 0
    more = ask(editor, "test", text=FETCH + "  - fallback: [{check: 1 > 0}, {wait: 1 s}]\n")
    assert more["tests"][0]["passed"]
    assert more["coverage"]["ways"] > told["coverage"]["ways"]


@pytest.mark.soak  # a test that was kept runs so as well
def test_tests_run_with_the_text_that_is_not_saved(editor: MissionEditor, project: Path) -> None:
    test = "rbx: 1\nkind: Test\nname: it_fetches\nrobot: ../robots/fetcher/robot.yaml\nmission: fetch\n"
    test += "expect:\n  outcome: success\n"
    (project / "missions/fetch.test.yaml").write_text(test, encoding="utf-8")
    (one,) = ask(editor, "test", text=FETCH.replace("wait: 2 s", "check: 1 > 2"))["tests"]
    assert not one["passed"]
    assert "failure" in str(one["problems"])
    assert (project / "missions/fetch.yaml").read_text(encoding="utf-8") == FETCH
    (one,) = ask(editor, "test", text=FETCH.replace("table", "tabel"))["tests"]
    assert not one["passed"]
