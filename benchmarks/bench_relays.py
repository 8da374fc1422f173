"""Ten relays: in a row, each in a process of its own: until a message has passed all, and after one was killed."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measuring import COMMAND, ROOT, Row, Samples, memory_of, program, tree
from benchmarks.peers import Dora, Ros, free_port, missing, running, wait_for
from rbxcompose.base.plugins import GROUP

MEASURES = ("rbxcompose/bus", "rbxcompose/runtime")

RELAYS = 10
KILLED = 5  # in the middle of the row
ROUNDS = 3
SETTLED = 1.0  # [s] of running before one is killed
NODES = Path(__file__).parent / "relay_nodes"
HEAD = "rbx: 1\nkind: Robot\nname: relays\nabout: Passes a message on.\ncomponents:\n"
RELAY = """  relay_{n}:
    type: {type}
    number: {n}
    folder: {folder}
    process: {process}
    connect: {{{wires}}}
"""
PACKAGE = """<package format="2"><name>relays</name><version>0.0.0</version><description>Relays</description>
<maintainer email="nobody@localhost">nobody</maintainer><license>Apache-2.0</license></package>
"""


@dataclass(slots=True)
class Times:
    """What was measured of one system: times [s], memory [bytes]."""

    starts: list[float] = field(default_factory=list)
    recoveries: list[float] = field(default_factory=list)
    memory: list[float] = field(default_factory=list)


Start = Callable[[Path], AbstractContextManager[int]]  # takes a folder for marks; gives the process above all others


def rows() -> list[Row]:
    """Return how long it takes until ten relays flow, what they take, how long one that was killed is missing."""
    systems: dict[str, Start] = {"ours": _own_processes, "together": _one_process}
    if Ros.is_here():
        systems[Ros.name] = _ros
    if Dora.is_here():
        systems[Dora.name] = _dora
    found = {name: Times() for name in systems}
    for _ in range(ROUNDS):
        for name, start in systems.items():
            with TemporaryDirectory() as folder:
                _measure(start, Path(folder), found[name], may_kill=name != "together")
    return _rows(found)


def _rows(found: dict[str, Times]) -> list[Row]:
    ours, together = found.pop("ours"), found.pop("together")
    how = f"from the start of the command until all have had a message, each relay in a process of its own{missing()}"
    in_one = "the same with all in one process, as components are unless the robot says otherwise"
    killed = f"`kill -9` of the sixth, until its successor has had a message{missing()}"
    pss = f"proportional set size of all processes{missing()}"
    most_start, most_recovery, most_memory = {Ros.name: 0.5, Dora.name: 0.33}, {Ros.name: 0.5, Dora.name: 1.0}, 0.45
    out = []
    for name, peer in found.items() or [("", Times())]:
        out += [
            _row("ten relays: `up` until all flow", how, ours.starts, peer.starts, name, most_start.get(name)),
            _row("ten relays: `up` until all flow", in_one, together.starts, peer.starts, name, most_start.get(name)),
            _row(
                "a relay that was killed flows again",
                killed,
                ours.recoveries,
                peer.recoveries,
                name,
                most_recovery.get(name),
            ),
            _row(
                "memory of ten relays",
                pss,
                ours.memory,
                peer.memory,
                name,
                most_memory if name == Ros.name else None,
                "MB",
                1e-6,
            ),
            _row(
                "memory of ten relays",
                f"{pss}, ours all in one process",
                together.memory,
                peer.memory,
                name,
                None,
                "MB",
                1e-6,
            ),
        ]
    return out


def _row(
    name: str,
    how: str,
    ours: list[float],
    peer: list[float],
    against: str,
    most_ratio: float | None,
    unit: str = "ms",
    scale: float = 1e3,
) -> Row:
    mine = Samples(tuple(ours))
    return Row(
        name=name,
        unit=unit,
        how=how,
        ours=mine.median * scale,
        p99=mine.p99 * scale,
        peer=Samples(tuple(peer)).median * scale if peer else None,
        against=against,
        most_ratio=most_ratio,
    )


def _measure(start: Start, folder: Path, times: Times, *, may_kill: bool) -> None:
    marks = folder / "marks"
    marks.mkdir()
    began = time.monotonic()
    with start(folder) as root:
        wait_for(lambda: all((marks / str(number)).exists() for number in range(RELAYS)), "ten relays")
        times.starts.append(max(_mark(marks, number)[1] for number in range(RELAYS)) - began)
        time.sleep(SETTLED)
        times.memory.append(sum(map(memory_of, tree(root))))
        if may_kill:
            times.recoveries.append(_recovery(marks))


def _recovery(marks: Path) -> float:
    pid, _ = _mark(marks, KILLED)
    killed = time.monotonic()
    os.kill(pid, signal.SIGKILL)
    wait_for(lambda: _mark(marks, KILLED)[0] != pid, "a relay that was killed")
    return _mark(marks, KILLED)[1] - killed


def _mark(marks: Path, number: int) -> tuple[int, float]:
    pid, at = (marks / str(number)).read_text(encoding="ascii").split()
    return int(pid), float(at)


def _own_processes(folder: Path) -> AbstractContextManager[int]:
    return _ours(folder, lambda number: f"relay_{number}")


def _one_process(folder: Path) -> AbstractContextManager[int]:
    return _ours(folder, lambda number: "robot")


@contextmanager
def _ours(folder: Path, process: Callable[[int], str]) -> Iterator[int]:
    site = folder / "site" / "relays-0.dist-info"
    site.mkdir(parents=True)
    (site / "METADATA").write_text("Metadata-Version: 2.1\nName: relays\nVersion: 0\n", encoding="utf-8")
    points = [f"component.{name} = benchmarks.relay_nodes.ours" for name in ("relay", "relay_source")]
    (site / "entry_points.txt").write_text("\n".join([f"[{GROUP}]", *points, ""]), encoding="utf-8")
    robot = folder / "robot.yaml"
    robot.write_text(HEAD + "".join(_component(folder, n, process(n)) for n in range(RELAYS)), encoding="utf-8")
    environment = {"XDG_RUNTIME_DIR": str(folder), "PYTHONPATH": f"{site.parent}:{ROOT}"}
    try:
        program([*COMMAND, "up", "-d", str(robot)], environment)()
        answer = json.loads(str(program([*COMMAND, "ps", "--json"], environment)()))
        yield answer["supervisor"]["pid"]
    finally:
        program([*COMMAND, "down"], environment)()


def _component(folder: Path, number: int, process: str) -> str:
    wires = f"told: link_{number + 1}" + (f", heard: link_{number}" if number else "")
    kind = "relay" if number else "relay_source"
    return RELAY.format(n=number, type=kind, folder=folder / "marks", process=process, wires=wires)


@contextmanager
def _ros(folder: Path) -> Iterator[int]:
    ros, package = Ros(folder, free_port()), folder / "relays"
    package.mkdir()
    (package / "package.xml").write_text(PACKAGE, encoding="utf-8")
    (package / "relay").symlink_to(NODES / "ros.py")
    nodes = [
        f'<node pkg="relays" type="relay" name="relay_{n}" args="{n} {folder / "marks"}" respawn="true"/>'
        for n in range(RELAYS)
    ]
    launch = folder / "relays.launch"
    launch.write_text("\n".join(["<launch>", *nodes, "</launch>"]), encoding="utf-8")
    with running(["/usr/bin/roslaunch", "-p", str(ros.port), str(launch)], ros.environment, folder) as process:
        yield process.pid


@contextmanager
def _dora(folder: Path) -> Iterator[int]:
    nodes = [
        {
            "id": f"relay_{n}",
            "path": str(NODES / "dora_node.py"),
            "restart_policy": "always",
            "env": {"RELAY_NUMBER": str(n), "RELAY_FOLDER": str(folder / "marks")},
            "inputs": {"heard": f"relay_{n - 1}/told" if n else "dora/timer/millis/10"},
            "outputs": ["told"],
        }
        for n in range(RELAYS)
    ]
    flow = folder / "relays.yml"
    flow.write_text(json.dumps({"nodes": nodes}), encoding="utf-8")
    with running(["dora", "run", str(flow)], Dora(folder).environment, folder) as process:
        yield process.pid
