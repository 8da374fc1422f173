"""Parameters on the command line, of a robot in real processes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.cli.param import _value
from rbxcompose.params.values import from_message

ROOT = Path(__file__).parents[2]
PATIENCE = 20.0  # [s]
MANIFEST = """
rbx: 1
kind: Robot
name: parameters
bus: {port: 7920, namespace: left}
args:
  speed: {type: speed, default: 0.3 m/s, max: 0.4 m/s}
components:
  battery: {type: battery_sim, runtime: 45 s}
  base: {type: diff_drive_sim}
  go_to: {type: go_to, speed: "${args.speed}"}
  second: {type: go_to, turn_rate: 45 deg/s, connect: {go_to: go_second}}
muxes:
  cmd_vel:
    inputs:
      first: {from: go_to, priority: 1, timeout: 0.5 s}
      second: {from: second, priority: 2, timeout: 0.5 s}
"""

Do = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def do() -> Iterator[Do]:
    """Run a command on a robot that is up."""
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(base), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
    (base / "robot.yaml").write_text(MANIFEST, encoding="utf-8")

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "rbxcompose", *words]
        return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE, cwd=ROOT)

    up = run("up", "-d", str(base / "robot.yaml"))
    assert up.returncode == 0, up.stderr
    yield run
    assert run("down").returncode == 0
    shutil.rmtree(base)


def test_all_parameters_of_all_components_are_listed(do: Do) -> None:
    listed = json.loads(do("param", "ls", "--json").stdout)
    found = {(one["node"], one["name"]): (one["value"], one["read_only"]) for one in listed}
    assert found["/left/battery", "runtime"] == (45.0, False)
    assert found["/left/battery", "initial"] == (1.0, True)
    assert found["/left/base", "max_speed"] == (0.5, False)
    shown = do("param", "ls", "battery").stdout
    assert [line.split()[:4] for line in shown.splitlines()][:2] == [
        ["component", "parameter", "value", "about"],
        ["/left/battery", "runtime", "45", "s"],
    ]


def test_a_parameter_is_set_with_its_unit_and_holds_at_once(do: Do) -> None:
    done = do("param", "set", "battery", "runtime", "1 min")
    assert (done.returncode, done.stdout) == (0, "1 min\n"), done.stderr
    assert do("param", "get", "/left/battery", "runtime", "--json").stdout == "60.0\n"
    assert "set: runtime = 60 s" in do("logs").stdout


def test_values_are_shown_as_a_person_writes_them(do: Do) -> None:
    rows = [line.split()[1:4] for line in do("param", "ls", "second").stdout.splitlines()]
    assert ["turn_rate", "45", "deg/s"] in rows
    assert do("param", "get", "second", "turn_rate").stdout == "45 deg/s\n"
    assert do("param", "ls", "cmd_vel").stdout.count("0.5 s") == 2


@pytest.mark.parametrize("text", ["0.2 m/s", "20 cm/s"])
def test_the_answer_has_the_unit_in_which_the_value_was_given(do: Do, text: str) -> None:
    done = do("param", "set", "second", "speed", text)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{text}\n", "")
    assert do("param", "set", "second", "speed", "0.3").stdout == "0.3 m/s\n"


def test_what_check_refuses_is_refused_while_the_robot_runs(do: Do) -> None:
    done = do("param", "set", "second", "speed", "0.7 m/s")
    assert (done.returncode, done.stdout) == (1, "")
    assert "'base' can do 0.5 m/s at most (RBX3503)" in done.stderr, done.stderr
    assert do("param", "get", "second", "speed").stdout == "0.3 m/s\n"


def test_a_rule_is_checked_with_the_values_that_other_components_have_now(do: Do) -> None:
    assert do("param", "set", "base", "max_speed", "0.8 m/s").returncode == 0
    assert do("param", "set", "second", "speed", "0.7 m/s").returncode == 0
    assert "RBX3503" in do("param", "set", "base", "max_speed", "0.5 m/s").stderr
    assert do("param", "set", "second", "speed", "0.3 m/s").returncode == 0
    assert do("param", "set", "base", "max_speed", "0.5 m/s").returncode == 0


def test_the_limit_of_an_argument_holds_for_live_values_too(do: Do) -> None:
    reason = "'speed' must be at most 0.4 m/s: the argument 'speed' of the robot says so"
    assert reason in do("param", "set", "go_to", "speed", "0.45 m/s").stderr
    assert do("param", "set", "go_to", "speed", "0.4 m/s").stdout == "0.4 m/s\n"


def test_the_services_of_the_component_know_the_limit_of_an_argument(do: Do) -> None:
    request = "{parameters: [{name: speed, value: {type: 3, double_value: 0.45}}]}"
    done = do("service", "call", "left/go_to/set_parameters", request)
    assert "must be at most 0.4 m/s" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("set", "battery", "initial", "0.5"), "'initial' cannot change while the robot runs"),
        (("set", "battery", "runtime", "3 m"), "'runtime' must be a time, such as '5 s'"),
        (("set", "battery", "runtme", "3"), "did you mean 'runtime'?"),
        (("get", "battery", "runtme"), "did you mean 'runtime'?"),
        (("get", "baterry", "runtime"), "did you mean 'left/battery'?"),
    ],
)
def test_what_cannot_be_done_is_told_with_the_reason(do: Do, words: tuple[str, ...], reason: str) -> None:
    done = do("param", *words)
    assert (done.returncode, reason in done.stderr) == (1, True), done.stderr


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.5", 0.5),
        ("3", 3),
        ("true", True),
        ("30 s", "30 s"),
        ("", ""),
        ("null", "null"),
        ("[1, 2]", (1, 2)),
        ("{a: 1}", "{a: 1}"),
        ("[1, x]", "[1, x]"),
        ("a: [", "a: ["),
    ],
)
def test_a_value_is_read_as_yaml_and_is_text_if_it_is_nothing_else(text: str, value: Any) -> None:
    assert from_message(_value(text)) == value
