"""Robots and missions of any size, without findings, for what grows with them."""

from __future__ import annotations

from pathlib import Path

HEAD = """# A robot that no one would build, to measure with.
rbx: 1
kind: Robot
name: large
about: As many batteries as are asked for, each with its own topics, place, value and group.

args:
  runtime:
    type: time
    default: 45 s
    about: From full to empty.
"""
COMPONENT = """  battery_{n}:
    type: battery_sim
    runtime: ${{args.runtime}}          # one argument for all of them
    initial: 90 %
    warn: 50 %
    error: 20 %
    connect:
      battery_level: battery_{n}/level
      set_battery_level: battery_{n}/set_level
"""


def robot(components: int) -> str:
    """Return a robot with that many components, and as many places, values and analyzers: about 14 lines for each."""
    numbers = range(components)
    return "\n".join(
        [
            HEAD,
            "places:",
            *(f"  spot_{n}: {{x: {n % 100} m, y: {n // 100}.5 m, heading: 90 deg}}" for n in numbers),
            "\nvalues:",
            *(f"  level_{n}: battery_{n}.battery_level" for n in numbers),
            "\ncomponents:",
            *(COMPONENT.format(n=n).rstrip("\n") for n in numbers),
            "\ndiagnostics:\n  analyzers:",
            *(f"    group_{n}:\n      match: [battery_{n}]" for n in numbers),
            "",
        ]
    )


def of_lines(lines: int) -> str:
    """Return a robot of at most that many lines."""
    fixed = robot(0).count("\n")
    each = robot(1).count("\n") - fixed
    return robot((lines - fixed) // each)


def mission(nodes: int) -> str:
    """Return a mission of that many nodes: loops over lists of checks, waits, sets and logs."""
    head = "rbx: 1\nkind: Mission\nname: large\nabout: Long.\ndata:\n  round: 0\ndo:\n"
    block = [
        "  - repeat: 2",
        "    do:",
        "      - check: $battery > 5 % and $round < 1000",
        "      - set:",
        "          round: $round + 1",
        "      - wait: 10 ms",
        "      - log: round $round at $battery",
        "      - wait_for: $battery > 1 %",
        "        timeout: 1 s",
    ]
    each = 7  # the loop, its list and five steps
    return head + "\n".join(block * max(1, nodes // each)) + "\n"


def write(text: str, folder: Path) -> Path:
    """Write a robot down and return its file."""
    path = folder / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    return path
