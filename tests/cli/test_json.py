"""Whoever asks for JSON gets JSON, also where there is nothing to tell and where a person has made a mistake."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from rbxcompose.commands import verbs
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.log import start_new
from tests.conftest import ROOT
from tests.loops import for_all

# The words behind each verb that has `--json`, with a mistake in them: there is no such robot, file, code or type.
MISTAKES = {
    "action ls": "",
    "action send": "go_to",
    "apply": "nowhere.yaml",
    "arm bench": "nowhere.yaml",
    "arm calibrate-camera": "hand tag --timeout 1s",
    "arm fk": "resting nowhere.yaml",
    "arm go": "arm resting",
    "arm ik": "{x:1} nowhere.yaml",
    "arm ls": "nowhere.yaml",
    "arm picture": "reach nowhere.yaml --out x.png",
    "arm plan": "resting nowhere.yaml",
    "arm setup": "nowhere.yaml",
    "arm trace": "{points:[]} nowhere.yaml",
    "camera calibrate": "nowhere.png --chessboard 8x6 --square 25mm",
    "body check": "nowhere.yaml",
    "controller ls": "",
    "controller speed": "head 30%",
    "controller switch": "head",
    "diag ack": "",
    "diag echo": "",
    "diag history": "",
    "diag tree": "",
    "diag watch": "",
    "doctor": "pyproject.toml",
    "down": "nobody",
    "expand": "nowhere.yaml",
    "explain": "RBX1099",
    "fleet ls": "nowhere.yaml",
    "fleet run": "patrol nowhere.yaml",
    "import arbotix": "nowhere.yaml",
    "import bt": "nowhere.xml",
    "import diagnostics": "nowhere.yaml",
    "import launch": "nowhere.xml",
    "import mux": "nowhere.yaml",
    "import nav2": "nowhere.yaml",
    "import params": "nowhere.yaml",
    "import srdf": "nowhere.yaml",
    "logs": "--robot nobody",
    "map show": "",
    "mission break": "",
    "mission cancel": "",
    "mission explore": "patrl robots/turtlebot",
    "mission force": "go_home success",
    "mission forget": "",
    "mission jump": "home",
    "mission log": "",
    "mission ls": "",
    "mission pause": "",
    "mission resume": "",
    "mission run": "patrol",
    "mission set": "rounds=2",
    "mission skills": "nowhere.yaml",
    "mission status": "",
    "mission step": "",
    "mission triggers": "",
    "mission try": "patrl robots/turtlebot",
    "mission watch": "",
    "mux add": "teleop",
    "mux delete": "teleop",
    "mux lock": "",
    "mux ls": "",
    "mux select": "teleop",
    "mux unlock": "",
    "mux watch": "",
    "mux why": "",
    "msg export": "pyproject.toml",
    "msg ls": "nowhere.yaml",
    "msg new": "grasp",
    "msg show": "std_msgs/Strin",
    "msg stubs": "nowhere.yaml",
    "needs": "nowhere.yaml",
    "param describe": "base",
    "param diff": "",
    "param dump": "",
    "param get": "base max_speed",
    "param history": "",
    "param load": "nowhere.yaml",
    "param ls": "",
    "param reset": "",
    "param save": "baterry",
    "param set": "base max_speed 1",
    "param undo": "",
    "param watch": "",
    "plan": "nowhere.yaml",
    "ps": "nobody",
    "record": "--for 1s",
    "release": "",
    "replay": "nowhere.mcap --info",
    "scene add": "table {box:[1,1,1]}",
    "scene attach": "table hand",
    "scene check": "",
    "scene detach": "table",
    "scene distance": "",
    "scene load": "nowhere.scene",
    "scene ls": "",
    "scene picture": "",
    "scene remove": "table",
    "scene save": "table.scene",
    "scene watch": "",
    "security audit": "nowhere.yaml",
    "ros2 scan": "nowhere.yaml",
    "service call": "set_battery_level",
    "service ls": "",
    "servo disable": "1 --port nowhere",
    "servo enable": "1 --port nowhere",
    "servo identify": "1 --port nowhere",
    "servo info": "1 --port nowhere",
    "servo new-robot": "arm --port nowhere",
    "servo ping": "1 --port nowhere",
    "servo read": "1 present_position --port nowhere",
    "servo reboot": "1 --port nowhere",
    "servo relax": "1 --port nowhere",
    "servo scan": "--port nowhere",
    "servo set-id": "1 2 --port nowhere",
    "servo write": "1 led=1 --port nowhere",
    "stop": "--robot nobody",
    "test": "nowhere",
    "tf echo": "map base",
    "tf tree": "",
    "top": "nobody",
    "topic echo": "/odom",
    "topic hz": "/odom",
    "topic ls": "",
    "topic pub": "/chatter std_msgs/String",
    "topic show": "/odom",
    "udev check": "nowhere.yaml",
    "udev generate": "nowhere.yaml",
    "udev install": "nowhere.yaml --yes",
    "udev scan": "nowhere.yaml",
    "why": "components.base robots/turtlebot/robt.yaml",
    "world show": "nowhere.yaml",
}


@pytest.fixture(autouse=True)
def nothing_is_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.chdir(ROOT)


def leaves(parser: argparse.ArgumentParser, words: str) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield each verb, those below it in its place, with its parser."""
    below = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if not below:
        yield words, parser
    for group in below:
        for name, choice in group.choices.items():
            yield from leaves(choice, f"{words} {name}")


def test_each_verb_that_claims_it_is_looked_at_here() -> None:
    found = [leaf for verb in verbs.verbs() for leaf in leaves(verbs.parser_of(verb, verbs.load(verb)), verb)]
    assert {words for words, parser in found if "--json" in parser._option_string_actions} == set(MISTAKES)


@for_all("verb", MISTAKES)
def test_a_mistake_is_one_document(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main([*verb.split(), *MISTAKES[verb].split(), "--json"]) in (1, 2, 3)
    captured = capsys.readouterr()
    told = json.loads(captured.out)
    assert set(told) == {"error", "findings"}
    assert told["error"]
    assert told["error"] in captured.err
    assert all(finding["code"] in captured.err for finding in told["findings"])


def test_words_that_no_verb_takes_are_a_document_too(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["ps", "--colour", "--json"], ["topic", "hz", "/odom", "--for", "soon", "--json"]):
        with pytest.raises(SystemExit):
            command.main(words)
        captured = capsys.readouterr()
        told = json.loads(captured.out)
        assert told["findings"] == []
        assert told["error"] in captured.err


def test_a_replay_that_has_no_answer_refuses_to_give_one_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["replay", "nowhere.mcap", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["error"] == "--json needs --info or --into"


def test_without_json_the_words_on_stderr_are_all(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["ps"]) == 1
    assert capsys.readouterr().out == ""


def test_mistakes_in_a_file_are_told_with_their_places(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text("rbx: 1\nkind: Robot\nname: cart\ncomponents:\n  base: {type: bass}\n  arm: {type: armm}\n")
    for words in (["plan"], ["apply"], ["mission", "skills"]):
        assert command.main([*words, str(file), "--json"]) == 1
        told = json.loads(capsys.readouterr().out)
        assert [(finding["code"], finding["line"]) for finding in told["findings"]] == [("RBX3004", 5), ("RBX3004", 6)]
        assert told["error"] == told["findings"][0]["message"]


def test_a_log_without_a_line_is_no_line(capsys: pytest.CaptureFixture[str]) -> None:
    folder = RobotFolder.of("a")
    folder.make()
    start_new(folder.path).close()
    for words in (["logs", "--json"], ["logs", "a", "--level", "error", "--json"]):
        assert command.main(words) == 0
        assert capsys.readouterr().out == ""
