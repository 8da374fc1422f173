"""What `docs/seeing.md` shows of robots that follow a tag and dock at one is what they do in the worlds that ship."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rbxcompose.msgs.rbxcompose_msgs import DockAt, FollowTag
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.testing import Bench
from tests.docs.examples import checked, page_blocks


@pytest.mark.parametrize(
    ("kind", "skill", "action", "goal"),
    [
        ("tag_follower", "follow_tag", FollowTag, FollowTag.Goal("guide", distance=1.2, duration=10.0)),
        ("tag_docking", "dock_at", DockAt, DockAt.Goal("charger")),
    ],
)
def test_the_robot_of_the_page_finds_its_tag(tmp_path: Path, kind: str, skill: str, action: Any, goal: Any) -> None:
    pytest.importorskip("cv2", reason="OpenCV is not installed")
    [block] = [one for one in page_blocks("yaml") if one.page == "seeing.md" and f"type: {kind}" in one.text]
    plan = checked(block, tmp_path).compilation.plan
    assert plan is not None
    bench = Bench(plan=plan)
    ends: list[Ended[Any]] = []
    bench.bus.action_client("me", f"/{skill}", action)(goal, ends.append)
    assert bench.run_until(lambda: bool(ends), 40.0)
    assert ends[0].outcome is Outcome.SUCCEEDED, ends[0].message
