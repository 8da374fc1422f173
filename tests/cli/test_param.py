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
components:
  battery: {type: battery_sim, runtime: 45 s}
  base: {type: diff_drive_sim}
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
        ["/left/battery", "runtime", "45.0", "live"],
    ]


def test_a_parameter_is_set_with_its_unit_and_holds_at_once(do: Do) -> None:
    done = do("param", "set", "battery", "runtime", "1 min")
    assert (done.returncode, done.stdout) == (0, "60.0\n"), done.stderr
    assert do("param", "get", "/left/battery", "runtime", "--json").stdout == "60.0\n"
    assert "set: runtime = 60 s" in do("logs").stdout


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
