"""Completion: what fits, from the parsers themselves; and in a real bash."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import pytest

from rbxcompose.bus.graph import Graph, GraphName
from rbxcompose.commands import main as command
from rbxcompose.commands import verbs
from rbxcompose.commands.lookup import BusPlace
from rbxcompose.runtime.folder import ComponentState, RobotFolder, RobotState
from rbxcompose.runtime.processes import Process, boot_id
from rbxcompose.tools.commands.completion import SCRIPTS, KnownValues, candidates, files, for_shell
from tests.loops import for_all

ROOT = Path(__file__).parents[2]
ECHO_OPTIONS = ["--count", "--domain", "--help", "--json", "--once", "--profile", "--robot", "--router", "--ssh-config"]


def nothing(metavar: str, dest: str, current: str, given: Mapping[str, str]) -> list[str]:
    return [f"{metavar}:{dest}"]


def fitting(*words: str) -> list[str]:
    return candidates(words, nothing)


def test_verbs_are_completed() -> None:
    assert fitting("to") == ["top", "topic"]
    assert fitting("") == verbs.verbs()
    assert fitting("--") == ["--help", "--version"]
    assert fitting("nonsense", "") == []


@for_all(
    "words, expected",
    [
        (("topic", ""), ["echo", "hz", "ls", "pub", "show"]),
        (("topic", "e"), ["echo"]),
        (("topic", "echo", "TO"), ["TOPIC:topic"]),
        (("topic", "echo", "--on"), ["--once"]),
        (("topic", "echo", "/odom", ""), ECHO_OPTIONS),
        (("topic", "--robot", "x"), []),
        (("check", "--format", "s"), ["sarif"]),
        (("check", "--format=s"), ["--format=sarif"]),
        (("check", "a.yaml", "PA"), ["PATH:paths"]),
        (("completion", "z"), ["zsh"]),
        (("record", "--topics", "a", "PAT"), ["PATTERN:topics"]),
        (("record", "--topics", "a", "--cla"), ["--class"]),
        (("param", "get", "base", "PA"), ["PARAMETER:name"]),
    ],
)
def test_words_options_and_values_are_completed_where_they_may_stand(
    words: tuple[str, ...], expected: list[str]
) -> None:
    assert fitting(*words) == expected


@for_all("verb", verbs.verbs())
def test_every_verb_can_be_completed(verb: str) -> None:
    assert "--help" in fitting(verb, "--")


def test_bash_tells_a_line_that_may_end_in_a_quote_and_takes_what_follows_a_colon() -> None:
    assert for_shell("bash", ["rbxcompose to"], lambda words: ["/".join(words)]) == ["to"]
    assert for_shell("bash", ["rbxcompose topic "], list) == ["topic", ""]
    assert for_shell("bash", ["rbxcompose up 'my rob"], list) == ["up", "my rob"]
    assert for_shell("bash", ["rbxcompose"], list) == [""]
    assert for_shell("bash", ["rbxcompose up rbx:ro"], lambda words: ["rbx:robots"]) == ["robots"]
    assert for_shell("zsh", ["rbxcompose", "to"], list) == ["to"]
    assert for_shell("fish", ["rbxcompose"], list) == [""]


@pytest.fixture
def up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A robot that is written down as if it were up."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(Process, "is_titled", lambda self, prefix: prefix == "rbxcompose cart: ")
    folder = RobotFolder.of("cart")
    folder.make()
    part, here = ComponentState("base", "toy", "active", "robot", 77, 0), Process.of(os.getpid())
    battery = ComponentState("battery", "battery_sim", "active", "world", 78, 0)
    folder.write_state(RobotState("cart", "/a/robot.yaml", here, {}, (part, battery), "tcp/127.0.0.1:1", boot_id(), 7))


@pytest.mark.usefixtures("up")
def test_robots_components_and_topics_are_known() -> None:
    asked: list[BusPlace] = []

    def graph(place: BusPlace) -> Graph:
        asked.append(place)
        return Graph((), [GraphName("/odom", (), ()), GraphName("/a/_b", (), ())], (), ())

    known = KnownValues(graph).of
    assert candidates(["down", "--robot", ""], known) == ["cart"]
    assert candidates(["param", "get", "b"], known) == ["base", "battery"]
    assert candidates(["param", "get", "battery", ""], known) == ["error", "runtime", "warn"]
    assert candidates(["param", "set", "battery", "r"], known) == ["runtime"]
    assert candidates(["param", "set", "battery.w"], known) == ["battery.warn"]
    assert candidates(["param", "set", "battery.warn=3%", "battery.e"], known) == ["battery.error"]
    assert candidates(["param", "get", "base", ""], known) == []
    assert candidates(["down", "ca"], known) == ["cart"]
    assert candidates(["topic", "echo", ""], known) == ["/odom"]
    assert candidates(["topic", "echo", "od"], known) == ["odom"]
    assert candidates(["topic", "echo", "--router", "tcp/9:9", "--domain", "3", ""], known) == ["/odom"]
    assert asked == [BusPlace("tcp/127.0.0.1:1", 7)] * 2 + [BusPlace("tcp/9:9", 3)]
    assert candidates(["topic", "pub", "/odom", "nav_msgs/Odo"], known) == ["nav_msgs/Odometry"]


def test_files_go_on_from_what_is_typed(tmp_path: Path) -> None:
    for name in ("robot.yaml", "notes.txt", ".hidden.yaml"):
        (tmp_path / name).touch()
    (tmp_path / "robots").mkdir()
    assert files(f"{tmp_path}/", (".yaml",)) == [f"{tmp_path}/robot.yaml", f"{tmp_path}/robots/"]
    assert files(f"{tmp_path}/no") == [f"{tmp_path}/notes.txt"]
    assert files(f"{tmp_path}/.h") == [f"{tmp_path}/.hidden.yaml"]
    assert files(f"{tmp_path}/nowhere/") == []


@pytest.mark.parametrize("shell", list(SCRIPTS))
def test_a_script_is_printed(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["completion", shell]) == 0
    assert f"rbxcompose __complete {shell} " in capsys.readouterr().out


@pytest.fixture
def bash(tmp_path: Path) -> Path:
    """A folder with `rbxcompose` on the path, and files to be completed."""
    program = tmp_path / "bin/rbxcompose"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m rbxcompose "$@"\n')
    program.chmod(0o755)
    (tmp_path / "my robots").mkdir()
    (tmp_path / "my.yaml").touch()
    return tmp_path


def completed(folder: Path, line: str) -> list[str]:
    """Return what a real bash would write, by the script that it has read."""
    script = f"""{SCRIPTS["bash"]}
COMP_LINE={line!r}; COMP_POINT=${{#COMP_LINE}}
_rbxcompose
printf '%s\\n' "${{COMPREPLY[@]}}"
complete -p rbxcompose >&2
"""
    environment = {
        **os.environ,
        "PATH": f"{folder / 'bin'}:{os.environ['PATH']}",
        "XDG_RUNTIME_DIR": str(folder),
        "PYTHONPATH": str(ROOT),
    }
    done = subprocess.run(
        ["bash", "--norc", "-c", script], env=environment, cwd=folder, capture_output=True, text=True, check=True
    )
    assert done.stderr == "complete -F _rbxcompose rbxcompose\n"
    return done.stdout.split("\n")[:-1]


def test_a_real_bash_completes(bash: Path) -> None:
    assert completed(bash, "rbxcompose comp") == ["completion"]
    assert completed(bash, "rbxcompose up my") == ["my\\ robots/", "my.yaml"]


def test_without_a_bus_it_is_silent_at_once(bash: Path) -> None:
    begin = time.monotonic()
    assert completed(bash, "rbxcompose topic echo --router tcp/127.0.0.1:1 ") == [""]
    assert time.monotonic() - begin < 10.0
