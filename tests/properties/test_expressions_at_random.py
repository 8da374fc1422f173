"""Random expressions never escape, hang or take more memory than they may."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.properties.random_expressions import expression
from tests.soak import Soak

ROOT = Path(__file__).parents[2]
BATCH = 500
QUICK, MANY = 200, 20_000


@pytest.mark.timeout(0)
def test_a_random_expression_stays_within_its_limits(soak: Soak) -> None:
    tried, computed, slowest, failures = 0, 0, 0.0, []
    count = soak.examples(QUICK, MANY)
    for first in range(0, count, BATCH):
        seeds = str(first), str(min(first + BATCH, count))
        command = [sys.executable, "-m", "tests.properties.random_expressions", *seeds]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=ROOT)
        if done.returncode:  # it hung, or there was no memory left even for a report
            failures.append(f"seeds {first} to {first + BATCH}: exit code {done.returncode}\n{done.stderr[-2000:]}")
            continue
        told = json.loads(done.stdout)
        failures += told["failures"]
        tried, computed = tried + told["tried"], computed + told["computed"]
        slowest = max(slowest, told["slowest"])
    note = f"{computed:,} had a value; the slowest took {1000 * slowest:.0f} ms"
    soak.tell("random expressions", tried, len(failures), note)
    assert failures == []
    assert computed > tried / 20  # else they would be too wild to tell anything


def test_a_seed_gives_the_same_expression_again() -> None:
    assert [expression(seed) for seed in range(100)] == [expression(seed) for seed in range(100)]
