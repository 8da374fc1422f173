"""The process of the editors: which robots share a manifest, and which editor a request is for."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.runtime.folder import ChosenLayers, RobotFolder
from rbxcompose.tools.mission_editor.editor import MissionEditor
from rbxcompose.tools.mission_editor.process import RobotEditors, Variables, answer_line, compile_with
from rbxcompose.tools.robot_editor.editor import LiveRobot, RobotEditor

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
    live = LiveRobot(RobotFolder(tmp_path), compiled, layers)
    editors = RobotEditors(MissionEditor(compiled, file, simulated), RobotEditor(compiled, file, others), live)
    change = {"op": "set", "path": ["places", "dock"], "values": {"x": 1}}
    given = {"do": "robot/look", "subject": "places", "changes": [change]}
    assert others == (("digger",) if shared else ())
    assert ("is the manifest of 'digger', too" in told(editors, **given)["refused"]) is shared
    assert "belongs to a system" in told(editors, do="robot/compare")["refused"]
    assert told(editors, do="palette", mission="none")["refused"] == "the robot has no mission 'none'"


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
