"""The pages of a system's robots have ports of their own, and know each other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.compiler.systems.share import share_of
from tests.conftest import ROOT

SYSTEM = """
rbx: 1
kind: System
name: house
hosts: {desk: {address: 10.9.0.1}, cellar: {address: 10.9.0.2}}
robots:
  scout: {robot: robot.yaml, instances: 2, on: desk}
  digger: {robot: robot.yaml, on: cellar}
"""


def gateway(plan: Plan) -> Any:
    (found,) = [instance.config for instance in plan.instances if instance.type == "gateway"]
    return found


def test_each_page_has_a_port_and_knows_where_the_others_are(tmp_path: Path) -> None:
    text = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8").partition("\nmissions:")[0]
    (tmp_path / "robot.yaml").write_text(f"{text}\nconsole: {{port: 8090}}\n", encoding="utf-8")
    (tmp_path / "system.yaml").write_text(SYSTEM, encoding="utf-8")
    system = compile_system(str(tmp_path / "system.yaml"), environment={})
    robots = system.robots
    assert {name: gateway(robot.plan).port for name, robot in robots.items()} == {
        "scout_1": 8090,
        "scout_2": 8091,
        "digger": 8092,
    }
    seen = gateway(share_of(system, robots["scout_2"], "desk")).fleet
    assert seen == {"scout_1": ":8090", "scout_2": ":8091", "digger": "10.9.0.2:8092"}
    assert gateway(share_of(system, robots["digger"], "cellar")).fleet["scout_1"] == "10.9.0.1:8090"


def test_a_robot_alone_has_no_fleet(tmp_path: Path) -> None:
    text = (ROOT / "systems/patrol_two_hosts.yaml").read_text(encoding="utf-8").replace("../robots", f"{ROOT}/robots")
    (tmp_path / "system.yaml").write_text(text, encoding="utf-8")
    system = compile_system(str(tmp_path / "system.yaml"), environment={})
    robot = system.robots["turtlebot"]
    assert share_of(system, robot, "desk").instances == tuple(
        instance for instance in robot.plan.instances if robot.hosts[instance.name] == "desk"
    )
