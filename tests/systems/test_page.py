"""The page on systems has every key, and its example is a system without errors."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from rbxcompose.base.findings import Severity
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.compiler.systems.share import exchange_of
from rbxcompose.manifest.system_file import HostModel, LinkModel, SystemFile, SystemRobotModel
from tests.conftest import ROOT

PAGE = (ROOT / "docs/systems.md").read_text(encoding="utf-8")


def test_its_example_can_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("robots/turtlebot", "missions"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    (tmp_path / "systems").mkdir()
    example = re.search(r"^```yaml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert example is not None
    (tmp_path / "systems/two_hosts.yaml").write_text(example[1], encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    system = compile_system("systems/two_hosts.yaml", environment={})
    assert [finding for finding in system.report if finding.severity is Severity.ERROR] == []
    hall = compile_system("systems/two_hosts.yaml", environment={}, profiles=["hall"])
    assert [finding for finding in hall.report if finding.severity is Severity.ERROR] == []
    assert hall.hosts["robot"].address == "10.9.0.2"
    hosts = system.robots["turtlebot"].hosts
    assert (hosts["base"], hosts["mission"], hosts["go_to"], hosts["charger"]) == ("robot", "desk", "desk", "tablet")


def test_its_robot_may_command_the_other_as_its_mission_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "robots", tmp_path / "robots")
    shutil.copytree(ROOT / "missions", tmp_path / "missions")
    (tmp_path / "robots/turtlebot").rename(tmp_path / "robots/scout")
    blocks = re.findall(r"^```yaml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    (robots,) = (block for block in blocks if "callers:" in block)
    (mission,) = (block for block in blocks if block.startswith("do:"))
    (tmp_path / "robots/dispatcher").mkdir()
    (tmp_path / "systems").mkdir()
    hosts = "hosts: {one: {address: 10.0.0.1, labels: [floor]}, desk: {}}"
    head = "rbx: 1\nkind: {}\nname: both\n"
    (tmp_path / "systems/system.yaml").write_text(f"{head.format('System')}{hosts}\n{robots}", encoding="utf-8")
    (tmp_path / "missions/send.yaml").write_text(head.format("Mission") + mission, encoding="utf-8")
    robot = f"{head.format('Robot')}places: {{far: {{x: 2 m, y: 0 m}}}}\nmissions: {{send: ../../missions/send.yaml}}\n"
    (tmp_path / "robots/dispatcher/robot.yaml").write_text(robot, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    system = compile_system("systems/system.yaml", environment={})
    assert [finding.message for finding in system.report] == []
    given = exchange_of(system, system.robots["scout"], "one")
    assert given is not None
    assert [wire.own for wire in given.gives] == ["/go_to", "/set_battery_level"], "nobody takes its odometry"


@pytest.mark.parametrize("model", [SystemFile, HostModel, SystemRobotModel, LinkModel])
def test_it_has_every_key(model: type[HostModel]) -> None:
    assert model.model_fields.keys() - set(re.findall(r"\w+", PAGE)) - {"about"} == set()
