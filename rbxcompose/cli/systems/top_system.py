"""`top SYSTEM` on a terminal: each host tells of its shares once a second, and all of them are one picture."""

from __future__ import annotations

import json
import os
import select
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import FrameType
from typing import Any

from rbxcompose.cli.output.console import has_colour
from rbxcompose.cli.output.terminal import full_screen, raw, show
from rbxcompose.cli.systems.everywhere import Shares
from rbxcompose.cli.systems.remote import Remote
from rbxcompose.cli.systems.system_picture import ShareView, system_lines
from rbxcompose.printable import plain

_PERIOD = 0.5  # [s] between two pictures
_AGAIN = 3.0  # [s] after a command has ended until it is started again
_MOST_READ = 1024  # bytes of keys per read


class LiveShare:
    """Follows what a host tells of a share; a command that ends is started again."""

    def __init__(self, host: str, robot: str, remote: Remote) -> None:
        self._host, self._robot = host, robot
        self._command = remote.rbxcompose(["top", robot, "--json", "--follow"])
        self._told: Mapping[str, Any] | None = None
        self._since = self._ended = time.monotonic()
        self._problem = self._last = ""
        self._started()

    def _started(self) -> None:
        self._process = process = subprocess.Popen(
            self._command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,  # an interrupt is for us
        )
        self._thread = threading.Thread(target=self._read, args=(process,), daemon=True)
        self._thread.start()

    def _read(self, process: subprocess.Popen[str]) -> None:
        for line in process.stdout or ():
            try:
                told = json.loads(line)
            except ValueError:
                self._last = self._last or plain(line.strip())
                continue
            if isinstance(told, dict) and "components" in told:
                self._told, self._since, self._problem, self._last = told, time.monotonic(), "", ""
        if process.stdout is not None:
            process.stdout.close()
        process.wait()
        self._problem, self._ended, self._last = self._last or "it has ended", time.monotonic(), ""

    def view(self) -> ShareView:
        """Return what is known now."""
        now = time.monotonic()
        if not self._thread.is_alive() and now - self._ended > _AGAIN:
            self._started()
        return ShareView(self._robot, self._host, self._told, now - self._since, self._problem)

    def close(self) -> None:
        """End the command."""
        self._process.terminate()
        self._thread.join()


def show_system(name: str, shares: Shares) -> int:
    """Show all shares until q or Ctrl-C."""
    keyboard, colour = sys.stdin.fileno(), has_colour(sys.stdout)
    live = [
        LiveShare(host, robot, remote) for (host, robot), remote in sorted(shares.items(), key=lambda one: one[0][::-1])
    ]
    try:
        with _interrupts() as interrupted, raw(keyboard), full_screen(sys.stdout):
            while not interrupted:
                size = shutil.get_terminal_size()  # takes 80 x 24 for a terminal that reports 0 x 0
                views = [one.view() for one in live]
                show(sys.stdout, system_lines(name, views, size.columns, size.lines, colour=colour))
                ready, _, _ = select.select([keyboard], [], [], _PERIOD)
                keys = os.read(keyboard, _MOST_READ) if ready else b"-"
                if not keys or b"q" in keys.lower():
                    break
    finally:
        for one in live:
            one.close()
    return 0


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """Collect interrupts instead of ending by them."""
    found: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        found.append(number)

    before = signal.signal(signal.SIGINT, note)
    try:
        yield found
    finally:
        signal.signal(signal.SIGINT, before)
