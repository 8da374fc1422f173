"""Who commands motion follows from who is commanded: nothing passes a mux by unnoticed."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.testing import check_text
from tests.checks import strangers

ROBOT = """rbx: 1
kind: Robot
name: pushed
components:
  base: {{type: diff_drive_sim}}{more}
muxes:
  cmd_vel:
    inputs:
      teleop: {{priority: 100, timeout: 0.5 s}}
"""
MISSION = "rbx: 1\nkind: Mission\nname: push\ndo:\n  - publish: {topic}\n    message: {{linear: {{x: 0.1 m/s}}}}\n"


def test_a_writer_that_does_not_call_it_a_command_is_told(tmp_path: Path) -> None:
    assert strangers.Pusher.velocity.topic == "cmd_vel"
    checked = check_text(ROBOT.format(more="\n  pusher: {type: toy_pusher}"), tmp_path)
    assert checked.codes == ["RBX3001"]
    assert "'cmd_vel' and 'pusher' both write commands on '/cmd_vel'" in checked.text


@pytest.mark.parametrize(("topic", "codes"), [("cmd_vel", ["RBX3001"]), ("cmd_vel/teleop", [])])
def test_a_mission_is_told_at_its_line_and_the_cure_works(tmp_path: Path, topic: str, codes: list[str]) -> None:
    missions = {"push.yaml": MISSION.format(topic=topic)}
    checked = check_text(ROBOT.format(more="") + "missions:\n  push: push.yaml\n", tmp_path, others=missions)
    assert checked.codes == codes, checked.text
    if codes:
        assert "push.yaml:5:14" in checked.text
        assert "publish on an open input of the mux: cmd_vel/teleop" in checked.text
