"""What is said to somebody who wrote one wrong thing: each finding names the cure, with the person's own words."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.testing.manifests import check_text
from tests.misconfig.corpus import HERE

ROBOT = (HERE / "robot.yaml").read_text(encoding="utf-8")
MISSION = "rbx: 1\nkind: Mission\nname: work\ndo:\n  - go_to: kitchen\n"
GO_TO = "    type: go_to\n"

CURES = [
    (GO_TO, f"{GO_TO}    speed: 0.3 mps\n", "did you mean 'm/s'?"),
    (GO_TO, f"{GO_TO}    turn_rate: 120/s\n", "write '120 deg/s' or '120 rad/s'"),
    ("heading: 90 deg", "heading: 45", "write '45 deg' or '45 rad'"),
    (
        GO_TO,
        "    type: lidar_driver\n",
        "types: diff_drive_sim, battery_sim, charger, chore_sim, go_to, diagnostics, estop, mission and 4 more; if a "
        "package brings it, install that; 'rbxcompose new component lidar_driver' begins one of your own",
    ),
]


@pytest.mark.parametrize(("right", "wrong", "cure"), CURES, ids=lambda one: one.strip().splitlines()[-1][:40])
def test_the_first_finding_about_a_mistake_tells_the_cure(right: str, wrong: str, cure: str, tmp_path: Path) -> None:
    assert right in ROBOT
    checked = check_text(ROBOT.replace(right, wrong, 1), tmp_path, others={"mission.yaml": MISSION})
    assert next(iter(checked.compilation.report)).help == cure
