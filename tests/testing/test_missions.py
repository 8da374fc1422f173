"""Missions without a robot, for tests of skills and kinds of nodes."""

from __future__ import annotations

import pytest

from rbxcompose.missions.program.program import RobotNames, Skill
from rbxcompose.testing import SteppedMission, compile_mission

ROBOT = RobotNames(skills={"blink": Skill("blink"), "beep": Skill("beep")})


def stepped(text: str) -> SteppedMission:
    program, findings = compile_mission(text, ROBOT)
    assert not list(findings)
    assert program is not None
    return SteppedMission(program, ROBOT)


def test_all_findings_of_a_mission_are_returned() -> None:
    program, findings = compile_mission("do: [blnik, {wait: 1 kg}]", ROBOT)
    assert program is not None
    assert sorted(finding.code for finding in findings) == ["RBX4102", "RBX4106"]


def test_what_is_no_mission_has_no_program() -> None:
    program, findings = compile_mission("[")
    assert program is None
    assert findings.has_errors


def test_it_goes_on_tick_by_tick() -> None:
    mission = stepped("do:\n  - blink\n  - wait: 2 s\n  - beep")
    assert (mission.tick(), mission.running) == ("running", ["blink"])
    mission.end("blink")
    assert (mission.tick(), mission.running) == ("running", [])
    assert (mission.tick(1.0), mission.running) == ("running", [])
    assert (mission.tick(1.0), mission.running) == ("running", ["beep"])
    mission.end("beep", success=False, message="it is broken")
    assert mission.tick() == "failure"
    assert mission.calls == [("blink", {}), ("beep", {})]
    assert "it is broken" in mission.told[-1]


def test_only_what_runs_can_end() -> None:
    mission = stepped("do: blink")
    with pytest.raises(KeyError):
        mission.end("beep")
