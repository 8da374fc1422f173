"""`expand`, `why`, `graph` and `plan` as commands: exit codes, streams, files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rbxcompose.commands import layout
from rbxcompose.commands import main as command
from rbxcompose.compiler.plan.dump import load
from tests.soak import rare

TURTLEBOT = "robots/turtlebot"
BROKEN = "rbx: 1\nkind: Robot\nname: one\ncomponents:\n  base:\n    type: diff_drive_sim\n    max_sped: 1 m/s\n"


@pytest.fixture(autouse=True)
def _at_home(repository: Path) -> None:
    """Paths are as from the repository's root."""


def output(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    assert command.main(words) == code
    return capsys.readouterr().out


def test_each_has_an_answer_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    assert json.loads(output(capsys, "expand", TURTLEBOT, "--json"))["robot"]["name"] == "turtlebot"
    answer = json.loads(output(capsys, "why", "battery.runtime", TURTLEBOT, "--profile", "tired", "--json"))
    assert (answer["value"], answer["si"], answer["unit"]) == ("30 s", 30.0, "s")
    assert load(output(capsys, "plan", TURTLEBOT, "--json")).robot == "turtlebot"
    found = json.loads(output(capsys, "plan", TURTLEBOT, "--profile", "tired", "--diff", TURTLEBOT, "--json"))
    assert found["changed"] == {"battery": [{"key": "runtime", "before": "45 s", "after": "30 s"}]}
    assert found["processes"]["restart"] == ["world"]


@pytest.mark.parametrize("verb", ["expand", "graph"])
def test_a_robot_with_mistakes_is_shown_with_its_findings_beside_it(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "robot.yaml").write_text(BROKEN)
    assert command.main([verb, str(tmp_path)]) == 1
    told = capsys.readouterr()
    assert ("name: one" if verb == "expand" else "transforms") in told.out
    assert "error[RBX1001]" in told.err


def test_a_robot_with_mistakes_has_no_plan(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "robot.yaml").write_text(BROKEN)
    assert output(capsys, "plan", str(tmp_path), code=1) == ""
    assert output(capsys, "plan", TURTLEBOT, "--diff", str(tmp_path), code=1) == ""


@pytest.mark.parametrize("words", [["expand"], ["why", "battery"], ["graph"], ["plan"]])
def test_a_robot_that_is_not_there_is_a_finding(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main([*words, "robots/nobody"]) == 1
    assert "error[RBX1301]" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        ("why", TURTLEBOT, "battery.runtime"),
        ("mission show", TURTLEBOT, "patrol"),
        *rare(("mission explore", TURTLEBOT, "patrol", "--states", "5"), ("arm fk", "robots/pi_robot", "wave")),
    ],
)
def test_a_robot_and_what_is_asked_of_it_are_understood_in_either_order(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    (verb, robot, asked), more = words[:3], words[3:]
    code = command.main([*verb.split(), asked, robot, *more])
    usual = capsys.readouterr().out
    assert usual
    assert output(capsys, *verb.split(), robot, asked, *more, code=code) == usual


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("robots/mini", "controllers.wheels"), 1, "'robots/mini' does not exist"),
        (("controllers.wheels", "mini"), 1, "'mini' does not exist"),
        ((TURTLEBOT,), 2, f"'{TURTLEBOT}' is a robot, and no value of it is named"),
    ],
)
def test_why_says_how_it_is_written(
    words: tuple[str, ...], code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main(["why", *words]) == code
    error = capsys.readouterr().err
    assert said in error
    assert "write 'rbxcompose why VALUE [ROBOT]'" in error


def test_a_path_that_leads_nowhere_is_a_finding(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["why", "batery.runtime", TURTLEBOT]) == 1
    assert "did you mean 'battery'?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("form", "begin"), [("mermaid", "flowchart LR"), ("dot", "digraph"), ("html", "<!doctype html>")]
)
def test_a_graph_goes_to_a_file_or_to_stdout(
    form: str, begin: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = output(capsys, "graph", TURTLEBOT, "--format", form)
    assert shown.startswith(begin)
    assert output(capsys, "graph", TURTLEBOT, "--format", form, "--out", str(tmp_path / "graph")) == ""
    assert (tmp_path / "graph").read_text(encoding="utf-8") == shown


def test_without_graphviz_a_page_is_refused_and_texts_are_not(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(layout, "find_spec", lambda name: None)
    assert command.main(["graph", TURTLEBOT, "--format", "html"]) == 1
    said = capsys.readouterr()
    assert "error[RBX9013]" in said.err
    assert "pip install 'rbxcompose[graph]'" in said.err
    assert said.out == ""
    assert output(capsys, "graph", TURTLEBOT, "--format", "dot").startswith("digraph")


def test_a_graph_that_cannot_be_written_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["graph", TURTLEBOT, "--out", str(tmp_path / "no/graph.html")]) == 2
    assert "cannot be written: No such file or directory" in capsys.readouterr().err


@pytest.mark.parametrize("content", [None, b"", b"{}", b"\xff\xfe", b'{"rbxcompose_plan": 99}'])
def test_a_file_that_is_no_plan_is_a_finding(
    content: bytes | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "before.json"
    if content is not None:
        file.write_bytes(content)
    assert command.main(["plan", TURTLEBOT, "--diff", str(file)]) == 1
    assert "error[RBX9012]" in capsys.readouterr().err


def test_a_saved_plan_can_be_compared_with(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "before.json"
    file.write_text(output(capsys, "plan", TURTLEBOT, "--json"), encoding="utf-8")
    assert output(capsys, "plan", TURTLEBOT, "--diff", str(file)) == "no difference\n"
    assert "speed: 0.3 m/s -> 0.2 m/s" in output(
        capsys, "plan", TURTLEBOT, "--set", "go_to.speed=0.2 m/s", "--diff", str(file)
    )
