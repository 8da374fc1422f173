"""Diagnostics: what the aggregator costs on a robot with many statuses, and when somebody floods it."""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measuring import Row, Samples, in_turns
from benchmarks.peers import ROS_PYTHON, Ros, free_port, running, wait_for
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus, KeyValue
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance

MEASURES = ("rbxcompose/msgs", "rbxcompose/domains/diagnostics")

RATE, GROUPS, ITEMS, MANY = 10, 20, 200, 10_000  # [Hz] in and out; groups; items of a robot, and of a flood
ROUNDS = 15
PARTS = tuple(f"part_{group}" for group in range(GROUPS))
AGGREGATOR = Path("/usr/lib/diagnostic_aggregator/aggregator_node")  # of Debian's libdiagnostic-aggregator-tools
PLUGINS = Path("/usr/share/diagnostic_aggregator/package.xml")  # of libdiagnostic-aggregator-dev
SECONDS, SETTLE = 8, 3.0  # [s] of ROS 1's aggregator, after it has begun


def rows() -> list[Row]:
    """Return the figures of diagnostics."""
    usual, flapping, flood = _second(ITEMS), _second(ITEMS, flaps=True), _second(MANY)
    levels, changes = in_turns(usual, flapping, rounds=ROUNDS)
    (flooded,) = in_turns(flood, rounds=3)
    ros = _ros()
    how = f"{ITEMS} items with 3 values at {RATE} Hz in, {GROUPS} analyzers, {RATE} Hz out, with decoding and encoding"
    return [
        _row("aggregated diagnostics", f"{how}; theirs in C++", levels, ros),
        Row(
            "the same, every level changes each time",
            "% of a core",
            "all changes are remembered, published and logged",
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


def _row(name: str, how: str, ours: Samples, ros: float | None) -> Row:
    theirs, against = (100 * ros, Ros.name) if ros else (None, "")
    return Row(name, "% of a core", how, 100 * ours.median, 100 * ours.p99, theirs, against, most=8)


def _ros() -> float | None:
    """Return the share of a core that ROS 1's aggregator takes for the same; None where it is not installed."""
    if not (Ros.is_here() and AGGREGATOR.exists() and PLUGINS.exists()):
        return None
    with TemporaryDirectory() as folder:
        ros = Ros(Path(folder), free_port())
        settings: Mapping[str, object] = {
            "pub_rate": RATE,
            "analyzers": {
                name: {"type": "diagnostic_aggregator/GenericAnalyzer", "path": name, "startswith": name}
                for name in PARTS
            },
        }
        load = [ROS_PYTHON, "/usr/bin/rosparam", "set", "/diagnostic_aggregator", json.dumps(settings)]
        robot = [ROS_PYTHON, str(Path(__file__).with_name("ros_diagnostics.py")), str(ITEMS), str(GROUPS)]
        with ros.master(), running(load, ros.environment, ros.folder) as loading:
            wait_for(lambda: loading.poll() is not None, "rosparam")
            with (
                running([str(AGGREGATOR)], ros.environment, ros.folder) as aggregator,
                running(robot, ros.environment, ros.folder),
            ):
                time.sleep(SETTLE)
                return statistics.median(_load(aggregator.pid) for _ in range(SECONDS))


def _load(pid: int) -> float:
    """Return the share of a core that a process takes for a second."""
    before, began = _processor_time(pid), time.monotonic()
    time.sleep(1.0)
    return (_processor_time(pid) - before) / (time.monotonic() - began)


def _processor_time(pid: int) -> float:
    tasks = Path(f"/proc/{pid}/task")
    spent = (int((task / "schedstat").read_text(encoding="ascii").split()[0]) for task in tasks.iterdir())
    return sum(spent) / 1e9


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
