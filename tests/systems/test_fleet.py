"""`fleet`: robots are chosen by labels, asked where they run, and each is told, also one that is down."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from rbxcompose.commands.hosts import Remote, Shares, shares_of
from rbxcompose.commands.main import main
from rbxcompose.compiler.systems.model import System
from rbxcompose.manifest.system_file import HostModel
from rbxcompose.testing.golden import Golden
from tests.conftest import ROOT

SYSTEM = """
rbx: 1
kind: System
name: fleet
hosts: {one: {address: 10.0.0.1, labels: [floor]}, two: {address: 10.0.0.2, ssh: two, labels: [floor]}}
robots:
  scout: {robot: ROOT/robots/turtlebot/robot.yaml, instances: 5, on: floor, labels: [indoor]}
  other: {robot: ROOT/robots/turtlebot/robot.yaml, on: one, place: {battery: two}}
"""
_HOST = """
import json, sys
host, *words = sys.argv[1:]
if words[0] == "logs" or words[0] == "mission":
    print(" ".join(words))
elif words[1] == "scout_2":
    print("error[RBX9002]: no robot is up"); raise SystemExit(1)
elif words[1] == "scout_3":
    print("ssh: connect: refused"); raise SystemExit(255)
elif words[1] == "scout_4":
    print(json.dumps({"error": "'r' does not answer: its supervisor has died, so it brakes and ends"}))
    print("error[RBX9005]: 'r' does not answer"); raise SystemExit(1)
elif words[1] == "scout_5":
    print(json.dumps({"error": "the folder is open to others", "findings": []})); raise SystemExit(1)
else:
    state = "failed" if host == "two" else "active"
    part = {"name": "battery", "state": state}
    missions = [{"mission": "patrol", "state": "running", "running": []}]
    seen = {"mission": "recover: success", "missions": missions, "batteries": {"battery": "80 %"}}
    print(json.dumps({**seen, "components": [part]}))
"""


class _Host(Remote):
    """A host whose rbxcompose is a script."""

    def rbxcompose(self, words: Sequence[str], *, folder: str = "", has_terminal: bool = False) -> list[str]:
        return [sys.executable, "-c", _HOST, self.name, *words]


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    def shares(system: System, config: Path | None) -> Shares:
        return {key: _Host(key[0], HostModel()) for key in shares_of(system, config)}

    monkeypatch.setattr("rbxcompose.commands.hosts.shares_of", shares)
    file = tmp_path / "fleet.yaml"
    file.write_text(SYSTEM.replace("ROOT", str(ROOT)), encoding="utf-8")
    return str(file)


def test_each_robot_is_a_row_with_what_is_wrong(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fleet", "ls", path, "--json"]) == 1
    rows = {robot["robot"]: robot for robot in json.loads(capsys.readouterr().out)["robots"]}
    assert rows["scout_1"] == {
        "robot": "scout_1",
        "host": "one",
        "state": "up",
        "mission": "running patrol",
        "battery": "80 %",
    }
    assert (rows["scout_2"]["state"], rows["scout_3"]["state"]) == ("down", "unreachable")
    assert (rows["scout_4"]["state"], rows["scout_5"]["state"]) == ("supervisor dead", "the folder is open to others")
    assert (rows["other"]["host"], rows["other"]["state"]) == ("one, two", "two battery not active")


@pytest.mark.parametrize(
    ("labels", "robots"),
    [
        (["indoor"], {f"scout_{number}" for number in range(1, 6)}),
        pytest.param(["scout"], {f"scout_{number}" for number in range(1, 6)}, marks=pytest.mark.soak),
        (["indoor", "scout_2"], {"scout_2"}),
        pytest.param(["other"], {"other"}, marks=pytest.mark.soak),
    ],
)
def test_a_mission_starts_on_the_robots_that_have_all_labels(
    path: str, capsys: pytest.CaptureFixture[str], labels: list[str], robots: set[str]
) -> None:
    options = [word for label in labels for word in ("--label", label)]
    assert main(["fleet", "run", "patrol", path, "--set", "rounds=3", *options]) == 0
    told = capsys.readouterr().out
    lines = [line for line in told.splitlines() if "mission run patrol --set rounds=3" in line]
    assert {line.rpartition(" ")[2] for line in lines} == robots


def test_the_logs_of_all_are_shown_with_their_robots(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fleet", "logs", path, "--label", "scout", "-n", "3"]) == 0
    assert "two scout_2 | logs scout_2 --level info -n 3" in capsys.readouterr().out


def test_an_unknown_label_is_a_finding_with_those_that_exist(
    path: str, capsys: pytest.CaptureFixture[str], golden: Golden
) -> None:
    assert main(["fleet", "ls", path, "--label", "indor"]) == 1
    golden.check("RBX6130.txt", capsys.readouterr().err)
    assert main(["fleet", "ls", path, path]) == 1
    assert "RBX6121" in capsys.readouterr().err
