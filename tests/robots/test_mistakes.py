"""Several mistakes in robot and mission at once: each is told at its line, and nothing that only follows from them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.testing.golden import Golden

ROBOT, MISSION = "robots/turtlebot/robot.yaml", "missions/patrol.yaml"
SLIPS = {
    ROBOT: {
        "type: battery_sim": "type: batery_sim",
        "from: go_to": "form: go_to",
        "max_speed: 0.5 m/s": "max_speed: 0.5 s",
    },
    MISSION: {"- recharge": "- rechrge", "go_to: dock": "go_to: dok", "corner_3": "corner3"},
}


@pytest.fixture
def project(tmp_path: Path, repository: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the robot and its mission, as the current folder."""
    for name in SLIPS:
        (tmp_path / name).parent.mkdir(parents=True)
        shutil.copy(repository / name, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_all_slips_are_told_in_one_run_and_nothing_else(project: Path, golden: Golden) -> None:
    for name, slips in SLIPS.items():
        text = (project / name).read_text(encoding="utf-8")
        for right, wrong in slips.items():
            assert right in text
            text = text.replace(right, wrong)
        (project / name).write_text(text, encoding="utf-8")
    out = compile_robot(ROBOT, environment={})
    assert out.plan is None
    golden.check("six_slips.txt", render_text(out.report, out.sources))
