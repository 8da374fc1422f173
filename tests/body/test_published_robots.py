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
    failures = [one for one in found if one.loads and (one.difference is None or one.difference > CLOSE)]
    failures += [one for one in found if one.loads and one.drawn not in ("yes", NOTHING_TO_DRAW)]
    failures += [one for one in found if not one.loads and not one.findings]
    loaded = sum(one.loads for one in found)
    told = sum(bool(one.findings) for one in found)
    soak.tell("published robots", len(found), len(failures), f"{loaded} read, the others refused; {told} with findings")
    if soak.is_on:
        RESULTS.write_text(json.dumps([asdict(one) for one in found], indent=1) + "\n", encoding="utf-8")
    assert failures == []
