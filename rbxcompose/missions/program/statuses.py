"""Statuses of mission nodes: plain integers, because they are written for every node at every tick."""

from __future__ import annotations

from typing import Final

IDLE: Final = 0  # not started, or halted
RUNNING: Final = 1
SUCCESS: Final = 2
FAILURE: Final = 3
SKIPPED: Final = 4  # did not need to start: neither success nor failure

NAMES: Final = ("idle", "running", "success", "failure", "skipped")
