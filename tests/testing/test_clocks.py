"""Nobody but the drivers asks for time: the check itself, and that all which is given time keeps to it."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.testing import clock_uses
from tests.loops import for_all
from tests.project.package import PACKAGE, files, imported_by

GIVEN_TIME = ("domains", "missions", "sdk")
CLOCKS = {"asyncio", "datetime", "os", "sched", "signal", "threading", "time"}  # modules that have some
OWN_TIME = {  # drivers of hardware, simulated hardware, processes and commands, which have clocks of their own
    "command_actions.py",
    "command_line.py",
    "dynamixel_bus.py",
    "dynamixel_port.py",
    "servo_twin.py",
    "planning_processes.py",
    "child.py",
    "editor_process.py",
    "keeper.py",
    "ros_bridge.py",
    "ros_side.py",
}


@for_all(
    "text, found",
    [
        ("import time\ntime.sleep(1)", ["x.py:2: time.sleep"]),
        ("import time as t\nx = t.monotonic", ["x.py:2: time.monotonic"]),
        ("from time import monotonic as m\nm()", ["x.py:1: time.monotonic", "x.py:2: time.monotonic"]),
        ("import datetime\ndatetime.datetime.now()", ["x.py:2: datetime.datetime.now"]),
        ("from datetime import datetime as d\nd.utcnow()", ["x.py:2: datetime.datetime.utcnow"]),
        ("import asyncio\nasync def f():\n    await asyncio.sleep(1)", ["x.py:3: asyncio.sleep"]),
        ("import threading\nthreading.Timer(1, f)", ["x.py:2: threading.Timer"]),
        ("from threading import Timer", ["x.py:1: threading.Timer"]),
    ],
)
def test_a_clock_is_found_under_any_name(text: str, found: list[str], tmp_path: Path) -> None:
    file = tmp_path / "x.py"
    file.write_text(text, encoding="utf-8")
    assert clock_uses(file) == found


@pytest.mark.parametrize(
    "text",
    [
        "time = self.now\ntime.sleep",
        "from datetime import datetime\ndatetime.fromtimestamp(3)",
        "from .time import now\nnow()",
        "import threading\nthreading.Lock()",
        "'time.sleep(1)'  # time.sleep(1)",
    ],
)
def test_what_only_looks_like_a_clock_is_none(text: str, tmp_path: Path) -> None:
    file = tmp_path / "x.py"
    file.write_text(text, encoding="utf-8")
    assert clock_uses(file) == []


def test_cores_components_and_the_sdk_never_ask_for_time() -> None:
    given = [path for path in files() if path.relative_to(PACKAGE).parts[0] in GIVEN_TIME]
    asking = [path for path in given if "commands" not in path.parts and not CLOCKS.isdisjoint(modules_in(path))]
    assert len(given) > 100
    assert {path.name for path in asking if clock_uses(path)} <= OWN_TIME


def modules_in(path: Path) -> set[str]:
    return {module.partition(".")[0] for module, _ in imported_by(path)}
