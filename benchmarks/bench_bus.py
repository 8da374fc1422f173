"""The bus: between two processes, beside what Zenoh alone and ROS 1 take for the same, measured in turns."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.bus_ends import FLOOD, OUR_FLOOD
from benchmarks.measuring import ROOT, Row, Samples
from benchmarks.peers import ROS_PYTHON, Ros, free_port
from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import open_router

MEASURES = ("rbxcompose/bus", "rbxcompose/msgs")

ROUNDS = 5
HOPS = 200  # per round
FLOODED = 100_000  # messages per round
PACE = 0.01  # [s] between two twists, as a control loop of 100 Hz sends them
ZENOH, CODED = "Zenoh alone", "Zenoh, CDR and attachment"
HOP = "Twist to another process and back, at 100 Hz"


class End:
    """One process that takes orders: of `bus_ends` or of `ros_ends`."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str]) -> None:
        mine, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                command, stdin=theirs.fileno(), stdout=theirs.fileno(), cwd=ROOT, env={**os.environ, **environment}
            )
        self._lines = mine.makefile("rw", encoding="utf-8", newline="\n")
        mine.close()  # the file is what is left open
        self.answer()

    def order(self, method: str, *arguments: object) -> None:
        """Let it do something."""
        self._lines.write(json.dumps([method, *arguments]) + "\n")
        self._lines.flush()

    def answer(self) -> Any:
        """Wait for what it answers.

        Raises:
            RuntimeError: if it has ended instead.
        """
        line = self._lines.readline()
        if not line:
            raise RuntimeError("an end of the bus has failed")
        return json.loads(line)

    def ask(self, method: str, *arguments: object) -> Any:
        """Let it do something and return what it answers."""
        self.order(method, *arguments)
        return self.answer()

    def close(self) -> None:
        """End it."""
        self._process.kill()
        self._process.wait()
        self._lines.close()


@contextmanager
def _ends(*roles: str) -> Iterator[list[End]]:
    port = free_port()
    router = open_router(tcp_endpoint(port))
    try:
        commands = [[sys.executable, "-m", "benchmarks.bus_ends", role, str(port)] for role in roles]
        with started_ends(commands, {}) as ends:
            yield ends
    finally:
        router.close()  # type: ignore[no-untyped-call]


@contextmanager
def ros_ends() -> Iterator[list[End]]:
    """Give an echo and an asker, or none where ROS 1 is not installed."""
    if not Ros.is_here():
        yield []
        return
    with TemporaryDirectory() as folder:
        ros = Ros(Path(folder), free_port())
        commands = [[ROS_PYTHON, str(Path(__file__).with_name("ros_ends.py")), role] for role in ("echo", "asker")]
        with ros.master(), started_ends(commands, ros.environment) as ends:
            yield ends


@contextmanager
def started_ends(commands: Sequence[Sequence[str]], environment: Mapping[str, str]) -> Iterator[list[End]]:
    """Start processes that take orders, and end them."""
    with ExitStack() as stack:  # those that have begun are ended if another one fails
        ends = []
        for command in commands:
            ends.append(End(command, environment))
            stack.callback(ends[-1].close)
        yield ends


@dataclass(slots=True)
class _Times:
    """What one side has shown: times [s], flows [Hz]."""

    hops: list[float] = field(default_factory=list)
    asked: list[float] = field(default_factory=list)
    set: list[float] = field(default_factory=list)
    received: list[float] = field(default_factory=list)
    handled: list[float] = field(default_factory=list)


def rows() -> list[Row]:
    """Return the figures of the bus."""
    ours, bare, coding, ros = _Times(), _Times(), _Times(), _Times()
    roles = ("our_echo", "bare_echo", "coding_echo", "our_asker", "bare_asker", "coding_asker")
    with _ends(*roles) as (_, flooder, _, our_asker, bare_asker, coding_asker), ros_ends() as of_ros:
        for _ in range(ROUNDS):
            sides = [(ours, our_asker), (bare, bare_asker), *((ros, end) for end in of_ros[1:])]
            for times, end in sides:
                times.hops += end.ask("hop", HOPS, PACE)
            coding.hops += coding_asker.ask("hop", HOPS, PACE)
            for times, end in sides:
                times.asked += end.ask("ask", HOPS)
            ours.set += our_asker.ask("set", HOPS)
            _flood(ours, flooder, our_asker, OUR_FLOOD)
            _flood(bare, flooder, bare_asker, FLOOD)
            if of_ros:
                _flood(ros, of_ros[0], of_ros[1])
    return [*_beside_zenoh(ours, bare, coding), *(_beside_ros(ours, ros) if ros.hops else [])]


def _flood(times: _Times, flooder: End, end: End, *key: str) -> None:
    end.order("count_flood", FLOODED)
    flooder.ask("flood", *key, FLOODED)
    answer = end.answer()
    for name in answer:
        getattr(times, name).append(answer[name])


def _beside_zenoh(ours: _Times, bare: _Times, coding: _Times) -> list[Row]:
    others = "" if Ros.is_here() else "; ROS 1 not installed here"
    return [
        _times(HOP, f"two hops{others}", ours.hops, bare.hops, ZENOH, 1.2),
        _times(HOP, "two hops", ours.hops, coding.hops, CODED),
        _times(
            f"the same with nothing but {CODED}",
            "the least that ROS 2's wire costs in Python",
            coding.hops,
            bare.hops,
            ZENOH,
        ),
        _times("service call to another process", "there and back", ours.asked, bare.asked, ZENOH),
        _times("parameter set in another process", "checked and taken; beside a request", ours.set, bare.asked, ZENOH),
        _flow("Twists received from another process", "a flood of 100,000", ours.received, bare.received, ZENOH, 0.5),
        _flow("Twists received, decoded and handled", "the same flood", ours.handled, bare.received, ZENOH),
    ]


def _beside_ros(ours: _Times, ros: _Times) -> list[Row]:
    rospy = "rospy"
    return [
        _times(HOP, "two hops", ours.hops, ros.hops, rospy, 1.5),
        _times("service call to another process", "theirs: a new connection each", ours.asked, ros.asked, rospy, 0.5),
        _flow("Twists received, decoded and handled", "theirs: with a queue", ours.handled, ros.handled, rospy, 8),
    ]


def _times(
    name: str, how: str, ours: list[float], theirs: list[float], against: str, most_ratio: float | None = None
) -> Row:
    mine, peer = Samples(tuple(ours)), Samples(tuple(theirs))
    return Row(
        name=name,
        unit="ms",
        how=f"{how}; p99 of {against}: {peer.p99 * 1e3:.2g} ms",
        ours=mine.median * 1e3,
        p99=mine.p99 * 1e3,
        peer=peer.median * 1e3,
        against=against,
        most_ratio=most_ratio,
    )


def _flow(
    name: str, how: str, ours: list[float], theirs: list[float], against: str, least_ratio: float | None = None
) -> Row:
    return Row(
        name=name,
        unit="1/s",
        how=how,
        ours=Samples(tuple(ours)).median,
        peer=Samples(tuple(theirs)).median,
        against=against,
        least_ratio=least_ratio,
    )
