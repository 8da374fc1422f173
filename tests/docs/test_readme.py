"""The README shows what its commands print."""

from __future__ import annotations

import re

from rbxcompose.runtime.log import StoryWriter
from rbxcompose.testing import run_robot
from rbxcompose.testing.manifests import check_file
from tests.docs.examples import ROOT

_LINE = re.compile(r"^ +\d+\.\d\d  \w.*$", re.MULTILINE)


def test_the_excerpt_is_what_the_patrol_prints() -> None:
    told = _LINE.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    plan = check_file(ROOT / "robots/turtlebot/robot.yaml").plan
    story = StoryWriter([instance.name for instance in plan.instances], colour=False)
    printed = iter([story.line(record) for record in run_robot(plan).bench.records])
    assert len(told) > 5
    assert [line for line in told if line not in printed] == [], "these lines, in this order"
