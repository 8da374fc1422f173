"""Published robots of many makers: each is read and placed as by Pinocchio, and drawn, or it is told why not."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from tests.body.published_robots import PACKAGE, folder, robots, tried_alone
from tests.soak import Soak

RESULTS = Path(__file__).parents[2] / "docs" / "robots_tried.json"
QUICK = ("double_pendulum", "xarm7", "icub_reduced")
CLOSE = 1e-9
NOTHING_TO_DRAW = "the body has no shapes"


@pytest.mark.timeout(0)
@pytest.mark.skipif(folder() is None, reason=f"{PACKAGE} is not installed")
def test_every_published_robot_is_read_placed_and_drawn(soak: Soak) -> None:
    found = [tried_alone(path) for path in robots() if soak.is_on or path.stem in QUICK]
    failures = [item for item in found if item.loads and (item.difference is None or item.difference > CLOSE)]
    failures += [item for item in found if item.loads and item.drawn not in ("yes", NOTHING_TO_DRAW)]
    failures += [item for item in found if not item.loads and not item.findings]
    loaded = sum(item.loads for item in found)
    told = sum(bool(item.findings) for item in found)
    soak.tell("published robots", len(found), len(failures), f"{loaded} read, the others refused; {told} with findings")
    if soak.is_on:
        RESULTS.write_text(json.dumps([asdict(item) for item in found], indent=1) + "\n", encoding="utf-8")
    assert failures == []
