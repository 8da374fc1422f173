"""The process of the editors: which robots share a manifest, and which editor a request is for."""

from __future__ import annotations

import json
import os
import re
from argparse import Namespace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from rbxcompose import __version__
from rbxcompose.base.requests import Refused
from rbxcompose.commands.console import NotDoneError
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.dump import load
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.runtime.folder import ChosenLayers, RobotFolder
from rbxcompose.runtime.plan_requests import ComparePlan, PlanComparison
from rbxcompose.runtime.supervision.plan_change import changes
from rbxcompose.tools import robot_changes
from rbxcompose.tools.mission_editor.editor import MissionEditor
from rbxcompose.tools.mission_editor.process import RobotEditors, Variables, answer_line, compile_with, compiled_member
from rbxcompose.tools.robot_editor.editor import LiveRobot, RobotEditor
from rbxcompose.tools.system_runs import layers_of, planned

ROBOT = "rbx: 1\nkind: Robot\nname: scout\nplaces:\n  dock: {x: 0 m, y: 0 m}\n"
SYSTEM = """rbx: 1
kind: System
name: house
hosts: {desk: {address: 10.9.0.1}}
robots:
  scout: {robot: robot.yaml, on: desk}
  digger: {robot: DIGGER, on: desk}
"""


def told(editors: RobotEditors, **request: Any) -> Any:
    return answer_line(editors, json.dumps(request))


@pytest.mark.parametrize(("digger", "shared"), [("robot.yaml", True), ("other.yaml", False)])
def test_a_robot_of_a_system_is_edited_unless_another_has_its_manifest(
    tmp_path: Path, digger: str, shared: bool
) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(ROBOT, encoding="utf-8")
    (tmp_path / "other.yaml").write_text(ROBOT.replace("scout", "digger"), encoding="utf-8")
    (tmp_path / "system.yaml").write_text(SYSTEM.replace("DIGGER", digger), encoding="utf-8")
    layers = ChosenLayers(system=str(tmp_path / "system.yaml"), member="scout")
    compiled, simulated, others = compile_with(str(file), layers)
    live = LiveRobot(RobotFolder(tmp_path), partial(compiled_member, layers, {}), layers)
    editors = RobotEditors(MissionEditor(compiled, file, simulated), RobotEditor(compiled, file, others), live)
    change = {"op": "set", "path": ["places", "dock"], "values": {"x": 1}}
    given = {"do": "robot/look", "subject": "places", "changes": [change]}
    assert others == (("digger",) if shared else ())
    assert ("is the manifest of 'digger', too" in told(editors, **given)["refused"]) is shared
    assert told(editors, do="palette", mission="none")["refused"] == "the robot has no mission 'none'"


SCOUT = """rbx: 1
kind: Robot
name: scout
console: {}
components: {seen: {type: topic_monitor, topic: /digger/odom, message: nav_msgs/Odometry, rate: 1}}
"""
DIGGER = """rbx: 1
kind: Robot
name: digger
console: {}
components: {base: {type: diff_drive_sim, max_speed: 1 m/s}}
"""
MEMBERS = """rbx: 1
kind: System
name: house
hosts: {desk: {address: 10.9.0.1}, shed: {address: 10.9.0.2}}
robots:
  digger: {robot: other.yaml, on: desk, share: [odom]}
  scout: {robot: robot.yaml, on: desk}
"""


@pytest.mark.parametrize(
    ("old", "new", "refused"),
    [
        ("", "", ""),
        (
            "share: [odom]",
            "share: [odom], share_port: 9000",
            "what robots share would change, so all change together: ",
        ),
        ("yaml, on: desk}", "yaml, on: desk, place: {seen: shed}}", "this robot runs on several hosts, which change"),
        ("  scout:", "  boss:", "this robot runs on no host of its system any more: 'rbxcompose apply"),
        ("scout: {robot: robot.yaml", "scout: {robot: other.yml", "its files have 1 error: "),
    ],
    ids=["as it is", "shared", "on two hosts", "gone", "error"],
)
def test_a_robot_of_a_system_is_compared_as_its_member(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, refused: str
) -> None:
    system = tmp_path / "system.yaml"
    for name, text in {"robot.yaml": SCOUT, "other.yaml": DIGGER, "system.yaml": MEMBERS}.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    running = compile_system(str(system), environment={})
    before = planned(running, running.robots["scout"], "desk")
    layers = layers_of(running, running.robots["scout"], real=False)

    def answered(folder: RobotFolder, request: ComparePlan, timeout: float) -> PlanComparison:
        found = changes(before, load(request.plan))
        return PlanComparison.of(found, 1, "; ".join(found.impossible))

    system.write_text(MEMBERS.replace(old, new), encoding="utf-8")
    monkeypatch.setattr(robot_changes, "find_robot", RobotFolder.of)
    monkeypatch.setattr(robot_changes, "known_state", lambda folder: None)
    monkeypatch.setattr(robot_changes, "answer_of", answered)
    live = LiveRobot(RobotFolder(tmp_path), partial(compiled_member, layers, {}), layers)
    if refused:
        with pytest.raises(Refused, match=re.escape(refused)):
            live.answer({"do": "robot/compare"})
    else:
        assert live.answer({"do": "robot/compare"})["is_empty"]


def test_a_robot_of_a_system_is_not_changed_to_what_it_is_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    layers = ChosenLayers(system="house.yaml", member="scout")
    state = Namespace(robot="scout", package_version=__version__, layers=layers)
    monkeypatch.setattr(robot_changes, "find_robot", RobotFolder.of)
    monkeypatch.setattr(robot_changes, "known_state", lambda folder: state)
    alone = compile_robot("rbx:robots/turtlebot", environment={})
    assert alone.plan is not None
    assert alone.robot is not None
    with pytest.raises(NotDoneError) as caught:
        robot_changes.Proposal.of(alone.plan, alone.robot, ChosenLayers())
    assert caught.value.finding.help == "rbxcompose apply house.yaml --robot scout"


def test_a_text_that_is_sent_reads_only_variables_that_files_on_disk_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "environ", {**os.environ, "COLOUR": "red", "API_KEY": "topsecret"})
    file, mission = tmp_path / "robot.yaml", tmp_path / "look.yaml"
    file.write_text(f"{ROBOT}missions: {{look: look.yaml}}\n", encoding="utf-8")
    mission.write_text("rbx: 1\nkind: Mission\nname: look\ndo: {log: '${env.COLOUR}'}\n", encoding="utf-8")
    compiled, _, _ = compile_with(str(file), ChosenLayers(), Variables())
    editor = MissionEditor(compiled, file)
    for do in ("look", "check", "aloud"):
        for name, is_told in (("COLOUR", True), ("API_KEY", False)):
            text = mission.read_text(encoding="utf-8").replace("COLOUR", name)
            answer = answer_line(editor, json.dumps({"do": do, "mission": "look", "text": text}))
            assert "topsecret" not in json.dumps(answer)
            assert ("is not set" in json.dumps(answer)) is not is_told
    assert os.environ["PATH"]
    compiled({})
    assert "API_KEY" not in os.environ
