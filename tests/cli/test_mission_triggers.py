"""`mission triggers` on a robot whose executive answers within this process."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.requests import Request, as_data, from_data, to_data
from rbxcompose.commands import main as command
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.testing.golden import Golden
from tests.executive.test_triggers import Triggered

TRIGGERS = """
nightly: {at: "22:00", on: [mon, fri], mission: greet}
morning: {at_start: true, mission: fail}
empty: {when: $battery < 15 %, mission: home, priority: 10, running: interrupt}
"""


def test_it_lists_what_starts_missions_with_the_next_time_and_the_last_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], golden: Golden
) -> None:
    robot = Triggered(tmp_path, TRIGGERS, is_alone=True)
    robot.bench.advance(60.0)
    mission = robot.bench.component("mission")

    def ask(folder: RobotFolder, request: Request[Any], *, timeout: float) -> Any:
        there = mission.requests().from_data(json.loads(json.dumps(as_data(request))))
        return from_data(request.answer_type(), json.loads(json.dumps(to_data(mission.handle(there)))))

    monkeypatch.setattr("rbxcompose.commands.lookup.ask", ask)
    monkeypatch.setattr("rbxcompose.commands.lookup.all_folders", lambda: [RobotFolder(tmp_path / "bot")])
    assert command.main(["mission", "triggers"]) == 0
    golden.check("mission_triggers.txt", capsys.readouterr().out)
    assert command.main(["mission", "triggers", "--json"]) == 0
    assert [one["next"] for one in json.loads(capsys.readouterr().out)] == ["Fri 1970-01-02 22:00", "", ""]
