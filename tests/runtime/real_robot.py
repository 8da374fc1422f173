"""A robot of toys in real processes, and how tests command it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.log import NAME, PREVIOUS, Follower, Record
from rbxcompose.runtime.processes import Process, titled
from tests.commands import command
from tests.forked import Forked

ROOT = Path(__file__).parents[2]
TOY = [sys.executable, str(Path(__file__).with_name("toy_robot.py"))]
LOG_FILES = {NAME, PREVIOUS}
PATIENCE = 60.0  # [s]; how long things may take is for their tests to say


def read_log(path: Path) -> list[Record]:
    """Return all records of a log, none if it does not exist."""
    follower = Follower(path)
    try:
        return follower.read()
    finally:
        follower.close()


def eventually(holds: Callable[[], bool]) -> None:
    """Wait until something holds; it must within `PATIENCE`."""
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline, "it never came true"
        time.sleep(0.01)


class Robot:
    """A toy robot with a name of its own, in a folder of its own."""

    def __init__(self, name: str, base: Path) -> None:
        self.name = name
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(base), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
        self.folder = RobotFolder(base / "rbxcompose" / name)
        self.started: list[subprocess.Popen[str]] = []

    def up(self, *options: str, **config: object) -> subprocess.Popen[str]:
        """Start it; the process is that of the foreground."""
        words = [*TOY, "--name", self.name, "--config", json.dumps(config), *options]
        process = Forked(
            words, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT
        )
        self.started.append(process)
        return process

    def up_detached(self, **config: object) -> str:
        """Start it, wait until it is up, return what was printed."""
        process = self.up("-d", **config)
        output, _ = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, output
        return output

    def do(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a command on it."""
        return command(*words, environment=self.environment, folder=ROOT)

    def ps(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self.do("ps", "--json").stdout)
        return found

    def process_of(self, component: str) -> Process:
        """Return the process that runs a component."""
        return Process.of(next(entry["pid"] for entry in self.ps()["components"] if entry["name"] == component))

    def supervisor(self) -> Process:
        return Process.of(self.ps()["supervisor"]["pid"])

    def processes(self) -> list[Process]:
        """Return all of its processes, whoever started them."""
        return [process for process in titled(f"rbxcompose {self.name}: ") if process.is_running]

    def last_words(self, source: str) -> list[str]:
        """Return the last two things that a toy said, but for the count of its steps, which goes on while it brakes."""
        return [text for text in self.texts(source) if not text.startswith("step ")][-2:]

    def texts(self, source: str | None = None) -> list[str]:
        """Return what was logged."""
        return [record.text for record in read_log(self.folder.path / NAME) if source in (None, record.source)]

    def has_logged(self, text: str) -> bool:
        return any(text in one for one in self.texts())
