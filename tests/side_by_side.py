"""Which tests may run side by side: those of one file never do, and those with deadlines in real time come first."""

from __future__ import annotations

REAL_TIME = {
    "servos, faults and pages": (
        "tests/actuation/test_bus_load",
        "tests/actuation/test_dynamixel_bus",
        "tests/actuation/test_recovery",
        "tests/cli/test_servo",
        "tests/controllers/test_diff_drive_bytes",
        "tests/console/test_page",
        "tests/devices/test_gamepad_for_real",
        "tests/exposure/",
        "tests/faults/",
        "tests/net/",
        "tests/robots/test_real_picking",
        "tests/robots/test_three_levels",
    ),
    "robots and systems": (
        "tests/console/test_gateway_live",
        "tests/mcp/test_operating",
        "tests/programs/test_up",
        "tests/ros2/test_bridge",
        "tests/runtime/test_apply_for_real",
        "tests/runtime/test_changes_for_real",
        "tests/runtime/test_external_clock",
        "tests/runtime/test_lifeline",
        "tests/runtime/test_mission_recovery",
        "tests/runtime/test_real_processes",
        "tests/systems/test_faults",
        "tests/systems/test_shared_calls",
        "tests/systems/test_three_hosts",
        "tests/systems/test_two_hosts",
        "tests/systems/test_two_robots",
    ),
}
"""Tests of real processes with deadlines, which mostly wait. A worker runs each group, from the beginning on."""

LONG = tuple(
    f"tests/{folder}/"
    for folder in ("mission_tests", "docs", "runtime", "systems", "robots", "motion", "components", "cli")
)
OTHERS = 5  # how much nicer all other tests are to those, so that these have a processor when they need one


def group_of(nodeid: str) -> str | None:
    """Return the group of a test with deadlines in real time."""
    return next((group for group, starts in REAL_TIME.items() if nodeid.startswith(starts)), None)


def turn_of(nodeid: str) -> int:
    """Return when a test has its turn: with the longest first, all workers end at about the same time."""
    return 0 if group_of(nodeid) else 1 if nodeid.startswith(LONG) else 2


def scope_of(nodeid: str) -> str:
    """Return what one worker runs together: tests of one file share what is costly to make."""
    file = nodeid.partition("::")[0]
    together = "tests/project/"  # they read all files of the package, once
    return group_of(file) or (together if file.startswith(together) else file)
