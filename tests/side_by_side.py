"""Which tests may run side by side: those of one file never do, nor do those with deadlines in real time."""

from __future__ import annotations

REAL_TIME = (
    "tests/actuation/test_bus_load",
    "tests/actuation/test_dynamixel_bus",
    "tests/actuation/test_recovery",
    "tests/cli/test_servo",
    "tests/controllers/test_diff_drive_bytes",
    "tests/exposure/",
    "tests/faults/",
    "tests/net/",
    "tests/robots/test_real_picking",
    "tests/robots/test_three_levels",
    "tests/runtime/test_apply_for_real",
    "tests/runtime/test_changes_for_real",
    "tests/runtime/test_external_clock",
    "tests/runtime/test_lifeline",
    "tests/runtime/test_real_processes",
    "tests/systems/test_faults",
    "tests/systems/test_shared_calls",
    "tests/systems/test_three_hosts",
    "tests/systems/test_two_hosts",
    "tests/systems/test_two_robots",
)
"""Tests of real processes with deadlines. One worker runs them all, so that they leave each other the processors."""


LONG = tuple(f"tests/{folder}/" for folder in ("docs", "runtime", "systems", "robots", "motion", "components", "cli"))


def turn_of(nodeid: str) -> int:
    """Return when a test has its turn: with the longest first, all workers end at about the same time."""
    return 0 if nodeid.startswith(REAL_TIME) else 1 if nodeid.startswith(LONG) else 2


def scope_of(nodeid: str) -> str:
    """Return what one worker runs together: tests of one file share what is costly to make."""
    file = nodeid.partition("::")[0]
    together = "tests/project/"  # they read all files of the package, once
    return "real time" if file.startswith(REAL_TIME) else together if file.startswith(together) else file
