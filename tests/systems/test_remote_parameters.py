"""`param` for a robot on another host: the values are those that it tells, the files those of this machine."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from rbxcompose.commands import hosts as everywhere
from rbxcompose.commands import hosts as forward
from rbxcompose.commands.hosts import Remote, Shares, shares_of
from rbxcompose.commands.main import main
from rbxcompose.compiler.compile import Compilation
from rbxcompose.compiler.systems.model import System
from rbxcompose.manifest.system_file import HostModel
from rbxcompose.runtime.folder import ChosenLayers
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.live_rules import compiled_with

ROBOT = """rbx: 1
kind: Robot
name: cart
components:
  battery:
    type: battery_sim
    runtime: 45 s  # short
"""
SYSTEM = """rbx: 1
kind: System
name: lab
hosts: {far: {address: 10.0.0.2, ssh: far}}
robots: {cart: {robot: cart.yaml}}
"""
REAL = """rbx: 1
kind: Robot
name: cart
components:
  battery: {type: threshold, topic: charge, warn_below: 20}
"""
REAL_HOSTS = {"real_one"}
_HOST = """
import json, sys
words = sys.argv[1:]
if words[0] == "true":
    pass
elif words[0] == "ps":
    print(json.dumps({"robot": "cart", "real": REAL}))
elif words[1] == "dump":
    print(json.dumps({"battery": {"warn_below": 30.0} if REAL else {"runtime": 30.0, "warn": 0.5}}))
elif words[1] == "history":
    name, before = ("warn_below", 20.0) if REAL else ("runtime", 45.0)
    print(json.dumps([{"component": "battery", "name": name, "before": before, "after": 30.0}]))
else:
    print(" ".join(words), "<", "" if words[1] == "set" else sys.stdin.read().strip())
"""


class _Host(Remote):
    """A host whose rbxcompose is a script that tells what it is asked."""

    @property
    def is_here(self) -> bool:
        return False

    def rbxcompose(self, words: Sequence[str], *, folder: str = "", has_terminal: bool = False) -> list[str]:
        return [sys.executable, "-c", _HOST.replace("REAL", str(self.name in REAL_HOSTS)), *words]

    def ssh(self, script: str, *, has_terminal: bool = False) -> list[str]:
        return [sys.executable, "-c", _HOST, script]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    def shares(system: System, config: Path | None) -> Shares:
        return {key: _Host(key[0], HostModel()) for key in shares_of(system, config)}

    monkeypatch.setattr(forward, "shares_of", shares)
    monkeypatch.setattr(everywhere, "shares_of", shares)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cart.yaml").write_text(ROBOT, encoding="utf-8")
    (tmp_path / "lab.yaml").write_text(SYSTEM, encoding="utf-8")
    return tmp_path


def test_a_value_that_somebody_has_set_there_is_written_here_at_its_place(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(["param", "diff", "--robot", "lab.yaml", "--json"]) == 1
    (found,) = json.loads(capfd.readouterr().out)
    assert (found["component"], found["name"], found["old"], found["new"]) == ("battery", "runtime", 45.0, 30.0)
    assert main(["param", "save", "--robot", "lab.yaml", "--dry-run"]) == 0
    assert (folder / "cart.yaml").read_text(encoding="utf-8") == ROBOT
    assert main(["param", "save", "--robot", "lab.yaml:cart"]) == 0
    assert (folder / "cart.yaml").read_text(encoding="utf-8") == ROBOT.replace("45 s", "30 s")


def test_a_robot_with_real_devices_is_compiled_as_that(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled, chosen = compiled_with, list[ChosenLayers]()

    def noted(file: str, layers: ChosenLayers, unsaved: Mapping[Path, str]) -> Compilation:
        chosen.append(layers)
        return compiled(file, layers, unsaved)

    monkeypatch.setattr("rbxcompose.tools.parameters.files.compiled_with", noted)
    assert main(["param", "diff", "--robot", "lab.yaml"]) == 1
    assert {item.real for item in chosen} == {False}
    chosen.clear()
    (folder / "cart.yaml").write_text(REAL, encoding="utf-8")
    (folder / "lab.yaml").write_text(SYSTEM.replace("far:", "real_one:"), encoding="utf-8")
    assert main(["param", "save", "--robot", "lab.yaml"]) == 0
    assert {item.real for item in chosen} == {True}
    assert (folder / "cart.yaml").read_text(encoding="utf-8") == REAL.replace("20", "30")


def test_a_file_that_somebody_has_edited_is_not_written_over(
    folder: Path, capfd: pytest.CaptureFixture[str], golden: Golden
) -> None:
    edited = ROBOT.replace("45 s", "50 s")
    (folder / "cart.yaml").write_text(edited, encoding="utf-8")
    assert main(["param", "save", "--robot", "lab.yaml"]) == 1
    golden.check("RBX9045.txt", capfd.readouterr().err)
    assert (folder / "cart.yaml").read_text(encoding="utf-8") == edited


def test_a_reset_sets_what_the_files_here_say(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["param", "reset", "--robot", "lab.yaml"]) == 0
    assert capfd.readouterr().out.startswith("param set battery.runtime=45.0 --robot cart")


def test_a_file_of_parameters_is_sent_along(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (folder / "values.yaml").write_text("battery: {runtime: 30 s}", encoding="utf-8")
    assert main(["param", "load", "values.yaml", "--robot", "lab.yaml"]) == 0
    assert capfd.readouterr().out.strip() == "param load - --robot cart < battery: {runtime: 30 s}"


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("RBX6121", ["topic", "pub", "/stop", "std_msgs/Empty", "--robot", "lab.yaml:cat"]),
        ("RBX6121b", ["topic", "pub", "/stop", "std_msgs/Empty", "--robot", "two.yaml"]),
        ("RBX6121c", ["param", "save", "--robot", "two.yaml"]),
        ("RBX6122", ["mission", "ls", "--robot", "lab.yaml"]),
    ],
)
def test_what_no_host_can_answer_is_a_finding(
    code: str, words: list[str], folder: Path, capfd: pytest.CaptureFixture[str], golden: Golden
) -> None:
    both = SYSTEM.replace("{cart: {robot: cart.yaml}}", "{cart: {robot: cart.yaml}, van: {robot: cart.yaml}}")
    (folder / "two.yaml").write_text(both, encoding="utf-8")
    assert main(words) == 1
    golden.check(f"{code}.txt", capfd.readouterr().err)
