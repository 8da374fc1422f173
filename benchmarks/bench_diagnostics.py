"""Diagnostics: what the aggregator costs on a robot with many statuses, and when somebody floods it."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.measuring import Row, in_turns
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue
from rbxcompose.qos import Qos
from rbxcompose.testing import Bench, instance

RATE, GROUPS, ITEMS, MANY = 10, 20, 200, 10_000  # [Hz] in and out; groups; items of a robot, and of a flood
ROUNDS = 15
PARTS = tuple(f"part_{group}" for group in range(GROUPS))


def rows() -> list[Row]:
    """Return the figures of diagnostics."""
    usual, flapping, flood = _second(ITEMS), _second(ITEMS, flaps=True), _second(MANY)
    levels, changes = in_turns(usual, flapping, rounds=ROUNDS)
    (flooded,) = in_turns(flood, rounds=3)
    how = f"{ITEMS} items with 3 values at {RATE} Hz in, {GROUPS} analyzers, {RATE} Hz out, with decoding and encoding"
    return [
        Row("aggregated diagnostics", "% of a core", how, 100 * levels.median, 100 * levels.p99, most=8),
        Row(
            "the same, every level changes each time",
            "% of a core",
            "all changes are remembered, published and told to the log",
            100 * changes.median,
            100 * changes.p99,
        ),
        Row(
            f"a flood of {MANY:,} items at {RATE} Hz",
            "% of a core",
            "of that, most is decoding; reports become rarer, as long as they have ten thousand rows",
            100 * flooded.median,
            100 * flooded.p99,
        ),
    ]


def _second(items: int, *, flaps: bool = False) -> Callable[[], object]:
    """Return what one second of robot time does, as a component of a host."""
    analyzers = {name: {"match": [name]} for name in PARTS}
    robot = Bench(instance("diagnostics", "diagnostics", {"rate": f"{RATE} Hz", "analyzers": analyzers}))
    send = robot.bus.publisher("source", "/diagnostics", DiagnosticArray, Qos.STATE)
    sent: list[int] = []
    for topic, message in (("/diagnostics_agg", DiagnosticArray), ("/diagnostics_toplevel_state", DiagnosticStatus)):
        robot.bus.subscribe("taker", topic, message, Qos.STATE, lambda one: sent.append(len(encode(one))))
    arrays = [encode(DiagnosticArray(status=_statuses(items, level if flaps else 0))) for level in (0, 2)]

    def second() -> None:
        before = len(sent)
        for step in range(RATE):
            send(decode(DiagnosticArray, arrays[step % 2]))
            robot.advance(1 / RATE)
        if items == ITEMS and len(sent) - before < 2 * RATE - 2:
            raise ValueError(f"reports were left out: {len(sent) - before}")

    return second


def _statuses(items: int, level: int) -> tuple[DiagnosticStatus, ...]:
    return tuple(
        DiagnosticStatus(
            level,
            f"{PARTS[index % GROUPS]}: item {index}",
            "works as it should",
            f"hardware {index}",
            (KeyValue("rate", "10.02 Hz"), KeyValue("temperature", "41.5 degC"), KeyValue("errors", "0")),
        )
        for index in range(items)
    )
