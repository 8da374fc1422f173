"""Triggers of a robot in real processes, whose executive is killed."""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.live_robot import PATIENCE, Robot
from tests.console.test_gateway_live import free_port

MANIFEST = """
rbx: 1
kind: Robot
name: triggered
bus: {{port: {port}}}
components: {{battery: {{type: battery_sim, runtime: 1 h}}}}
missions: {{first: first.yaml, second: second.yaml}}
values: {{battery: {{topic: battery_level, type: ratio, unit: "%"}}}}
triggers:
  begin: {{at_start: true, mission: first}}
  full: {{when: $battery > 50 %, mission: second}}
"""
STARTS = ("trigger begin (at start) starts mission first", "trigger full (when $battery > 50 %) starts mission second")


@pytest.fixture
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    for name in ("first", "second"):
        text = f"rbx: 1\nkind: Mission\nname: {name}\ndo: {{log: I am the {name}}}\n"
        base.joinpath(f"{name}.yaml").write_text(text, encoding="utf-8")
    made = Robot(base, MANIFEST.format(port=free_port()))
    made.environment["XDG_STATE_HOME"] = str(base / "state")
    up = made.do("up", "-d", str(made.file))
    assert up.returncode == 0, up.stderr
    yield made
    made.do("down")
    shutil.rmtree(base)


def executive(robot: Robot) -> tuple[int, int, str]:
    """Return the process of the executive, how often it was restarted, and its state."""
    (found,) = (one for one in robot.told("ps")["components"] if one["name"] == "mission")
    return found["pid"], found["restarts"], found["state"]


def log_with(robot: Robot, *words: str) -> str:
    """Return the log once it has these words."""
    deadline = time.monotonic() + PATIENCE
    while any(one not in (log := robot.do("logs").stdout) for one in words):
        assert time.monotonic() < deadline, log
    return log


@pytest.mark.timeout(100)
def test_what_triggers_have_started_is_not_started_again_by_the_next_process(robot: Robot) -> None:
    log_with(robot, *STARTS)
    os.kill(executive(robot)[0], signal.SIGKILL)
    deadline = time.monotonic() + PATIENCE
    while executive(robot)[1:] != (1, "active"):
        assert time.monotonic() < deadline
    assert robot.do("mission", "run", "first").returncode == 0
    log = log_with(robot, "restarting it")
    assert [log.count(text) for text in STARTS] == [1, 1]
    assert [one["came"] for one in robot.told("mission", "triggers")] == [
        "mission first started",
        "mission second started",
    ]
    assert robot.do("down").returncode == 0
    assert robot.do("up", "-d", str(robot.file)).returncode == 0
    assert [log_with(robot, *STARTS).count(text) for text in STARTS] == [1, 1]
