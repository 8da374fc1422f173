"""A robot in real processes, commands that address it, and a terminal for those that take keys."""

from __future__ import annotations

import json
import os
import pty
import select
import subprocess
import termios
from argparse import Namespace
from pathlib import Path
from typing import Any, Self

from rbxcompose.commands.lookup import BusPlace, find_place
from tests.commands import command
from tests.conftest import ROOT
from tests.forked import RBXCOMPOSE, Forked, run_command

PATIENCE = 20.0  # [s]


class Robot:
    """A robot in real processes, and the commands that address it."""

    def __init__(self, base: Path, text: str) -> None:
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(base), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
        self.file = base / "robot.yaml"
        self.file.write_text(f"{text}\n", encoding="utf-8")

    def command(self, *words: str) -> list[str]:
        return [*RBXCOMPOSE, *words]

    def do(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a command in this process, but for `up`, which is the beginning of others."""
        if words[0] == "up":
            return run_command(words, self.environment, PATIENCE)
        return command(*words, environment=self.environment, folder=ROOT)

    def told(self, *words: str) -> Any:
        """Return what a command answers in JSON."""
        done = self.do(*words, "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def place(self) -> BusPlace:
        endpoint = self.told("ps")["router"]["endpoint"]
        return find_place(Namespace(router=endpoint, domain=None))


class Keyboard:
    """A command at a terminal of its own; `ready` is what it shows once it takes keys."""

    def __init__(self, robot: Robot, *words: str, early: str = "", ready: str) -> None:
        self.ready = ready
        self.ours, self.theirs = pty.openpty()
        self.press(early)
        self.before = termios.tcgetattr(self.theirs)
        self.process = Forked(
            robot.command(*words),
            env=robot.environment,
            cwd=ROOT,
            stdin=self.theirs,
            stdout=self.theirs,
            stderr=self.theirs,
            start_new_session=True,
        )

    def until_ready(self) -> Self:
        self.until(self.ready)
        return self

    def until(self, words: str) -> str:
        """Return what is shown up to these words."""
        shown = ""
        while words not in shown:
            assert select.select([self.ours], [], [], PATIENCE)[0], shown
            shown += os.read(self.ours, 4096).decode()
        return shown

    def press(self, keys: str) -> None:
        os.write(self.ours, keys.encode())

    def end(self) -> int:
        """Wait for the end; the terminal must be what it was."""
        code = self.process.wait(PATIENCE)
        assert termios.tcgetattr(self.theirs) == self.before
        os.close(self.ours)
        os.close(self.theirs)
        return code
