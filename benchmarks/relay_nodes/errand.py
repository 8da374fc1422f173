"""A skill that is done at once, and writes down how long it has to wait for its next goal."""

from __future__ import annotations

import time
from pathlib import Path

from rbxcompose.msgs.rbxcompose_msgs import Recharge
from rbxcompose.sdk import Component, Config, ServesAction, component

MOST = 2000  # goals of which it writes down


class ErrandConfig(Config):
    """Where it writes."""

    file: str
    """One time [s] a line, on the machine's monotonic clock."""


@component("errand")
class Errand(Component[ErrandConfig]):
    """Succeeds with each goal as soon as it sees it."""

    rate = 500.0
    errand = ServesAction(Recharge, "errand")

    def configure(self) -> None:
        """Nothing has been done."""
        self.ended = 0.0  # [s] on the machine's monotonic clock
        self.waits: list[float] = []

    def accept_errand(self, goal: Recharge.Goal) -> str:
        """Note when a goal has come."""
        if self.ended:
            self.waits.append(time.monotonic() - self.ended)
        return ""

    def step(self, dt: float) -> None:
        """Be done with the goal."""
        if (goal := self.errand.current) is None:
            return
        self.ended = time.monotonic()
        goal.succeeded()
        if len(self.waits) == MOST:
            Path(self.config.file).write_text("\n".join(map(str, self.waits)), encoding="ascii")
