"""The start of a command."""

from __future__ import annotations

import time

from benchmarks.measuring import BARE, COMMAND, Row, in_turns, program

MEASURES = ("rbxcompose/commands", "rbxcompose/compiler", "rbxcompose/tools")


def rows() -> list[Row]:
    """Return the time until help is there, and until the smallest robot is checked."""
    shown, checked, bare = in_turns(
        program([*COMMAND, "--help"]),
        program([*COMMAND, "check", "robots/turtlebot"]),
        program(BARE),
        rounds=15,
        clock=time.perf_counter,
    )
    return [
        Row(
            name="`--help`",
            unit="ms",
            how="from start to exit, beside `python -c pass`",
            ours=shown.median * 1e3,
            p99=shown.p99 * 1e3,
            peer=bare.median * 1e3,
            against="python -c pass",
            most_ratio=5,
        ),
        Row(
            name="`check robots/turtlebot`",
            unit="ms",
            how="from start to exit",
            ours=checked.median * 1e3,
            p99=checked.p99 * 1e3,
            peer=bare.median * 1e3,
            against="python -c pass",
            most_ratio=20,
        ),
    ]
