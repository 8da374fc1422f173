"""A project of a user: the patrol robot, its mission, and a test of that."""

from __future__ import annotations

import shutil
from pathlib import Path

from tests.conftest import ROOT

ROBOT, MISSION, TEST = "robots/turtlebot/robot.yaml", "missions/patrol.yaml", "missions/tests/twice.test.yaml"
TWICE = """\
rbx: 1
kind: Test
name: twice
robot: ../../robots/turtlebot/robot.yaml
mission: patrol
mocks:
  go_to: {takes: 2 s}
expect:
  outcome: success
  count: {go_to: 8}
"""


def write_project(folder: Path) -> None:
    """Write the project into a folder."""
    for name in (ROBOT, MISSION, TEST):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
    for name in (ROBOT, MISSION):
        shutil.copy(ROOT / name, folder / name)
    (folder / TEST).write_text(TWICE, encoding="utf-8")


def changed(folder: Path, name: str, right: str, wrong: str) -> dict[str, str]:
    """Return the text of a file in which a word is another one, by the file's name."""
    text = (folder / name).read_text(encoding="utf-8")
    assert right in text
    return {name: text.replace(right, wrong)}
