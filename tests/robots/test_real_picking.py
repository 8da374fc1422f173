"""Picking and placing as `up` runs it: real processes, of which one or two plan, real time, and many seeds."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.soak import Soak

SEEDS = 20
LONGEST = 180.0  # [s] of a run, on a busy machine
UP = ("up", "robots/pi_robot", "--profile", "table", "--set", "start=pick_and_place")


@pytest.mark.timeout(SEEDS * LONGEST)
@pytest.mark.soak
def test_each_run_with_another_seed_picks_and_places(soak: Soak, tmp_path: Path) -> None:
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
    failures = {}
    for seed in range(SEEDS):
        words = [sys.executable, "-m", "rbxcompose", *UP]
        for name, value in (("seed", seed), ("processes", 1 + seed % 2)):
            words += ["--set", f"arms.right_arm.planner.{name}={value}"]
        try:
            done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=LONGEST)
        except subprocess.TimeoutExpired as late:
            failures[seed] = f"{late}\n{(late.stdout or b'').decode()}"
            continue
        if done.returncode != 0 or "mission pick_and_place: success" not in done.stdout:
            failures[seed] = done.stdout + done.stderr
    soak.tell("pick and place with `up`", SEEDS, len(failures))
    assert not failures, "\n\n".join(f"seed {seed}:\n{text}" for seed, text in failures.items())
