"""A bus of Dynamixel servos at 100 Hz: the processor time of a cycle, and what one mute servo costs the others.

A cycle reads load, speed and position of all servos by one sync read, and writes all goal positions by one sync write.
The peer is the stock SDK with its own port and group classes, in the same run.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from dynamixel_sdk import COMM_SUCCESS, GroupSyncRead, GroupSyncWrite, PacketHandler, PortHandler

from benchmarks.measuring import Row, Samples
from benchmarks.servo_replies import BAUD, served
from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.models import servo_models

MEASURES = ("rbxcompose/domains/servos",)

PERIOD = 0.01  # [s]
BLOCKS, CYCLES = 4, 60  # each side runs this many blocks of cycles, in turns
MODEL = servo_models()["XL430-W250"]
ITEMS = ("present_load", "present_speed", "present_position")
START, LENGTH = 126, 10  # of these items in memory [B]
GOAL, GOAL_SIZE = 116, 4

Cycle = Callable[[], set[int]]


@contextmanager
def _ours(path: Path, ids: range, timeout: float) -> Iterator[Cycle]:
    with DynamixelBus(str(path), dict.fromkeys(ids, MODEL), baud=BAUD, timeout=timeout, return_delay=0.0) as bus:

        def cycle() -> set[int]:
            found = bus.read(ids, ITEMS, budget=PERIOD / 2)
            bus.write({item: {"goal_position": 2048} for item in ids})
            return set(found)

        yield cycle


@contextmanager
def _stock(path: Path, ids: range) -> Iterator[Cycle]:
    port, packets = PortHandler(str(path)), PacketHandler(2.0)
    port.setBaudRate(BAUD)
    read = GroupSyncRead(port, packets, START, LENGTH)
    for one in ids:
        read.addParam(one)

    def cycle() -> set[int]:
        found = set(ids) if read.txRxPacket() == COMM_SUCCESS else set()
        values = {(item, read.getData(item, at, size)) for item in found for at, size in ((126, 2), (128, 4), (132, 4))}
        write = GroupSyncWrite(port, packets, GOAL, GOAL_SIZE)
        for one in ids:
            write.addParam(one, list((2048).to_bytes(GOAL_SIZE, "little")))
        write.txPacket()
        return {one for one, _ in values}

    yield cycle
    port.closePort()


def _block(cycle: Cycle, used: list[float], took: list[float], found: list[set[int]]) -> None:
    due = time.monotonic()
    for _ in range(CYCLES):
        due = max(due + PERIOD, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))
        processor, wall = time.process_time(), time.monotonic()
        found.append(cycle())
        used.append(time.process_time() - processor)
        took.append(time.monotonic() - wall)


def _compared(count: int, timeout: float, mute: tuple[int, ...] = ()) -> list[tuple[Samples, Samples, list[set[int]]]]:
    """Return the processor time [s], the wall time [s] and the answering servos of each cycle, ours and the SDK's."""
    ids = range(1, count + 1)
    results: list[tuple[list[float], list[float], list[set[int]]]] = [([], [], []), ([], [], [])]
    with ExitStack() as stack:
        first, second = stack.enter_context(served(2, LENGTH, mute))
        sides = [stack.enter_context(_ours(first, ids, timeout)), stack.enter_context(_stock(second, ids))]
        for _ in range(BLOCKS):
            for cycle, (used, took, found) in zip(sides, results, strict=True):
                _block(cycle, used, took, found)
    return [(Samples(tuple(used)), Samples(tuple(took)), found) for used, took, found in results]


def _lost(found: list[set[int]], expected: set[int]) -> float:
    """Return how many of the expected readings did not come [%]."""
    return 100 * sum(len(expected - numbers) for numbers in found) / (len(expected) * len(found))


def rows() -> list[Row]:
    """Return the cost of a cycle with 20 servos, and with one mute servo of six."""
    how = "protocol 2.0 at 1 Mbit/s, 10 B read and 4 B written per servo, 100 Hz, canned replies with wire time"
    stock = "the stock SDK"
    (ours, _, _), (theirs, _, _) = _compared(20, 0.002)
    (_, wall, found), (_, their_wall, their_found) = _compared(6, 0.004, mute=(3,))
    others = {1, 2, 4, 5, 6}
    return [
        Row(
            name="processor time of a cycle of 20 servos",
            unit="us",
            how=how,
            ours=1e6 * ours.median,
            p99=1e6 * ours.p99,
            peer=1e6 * theirs.median,
            against=stock,
            most=1000,
            most_ratio=0.2,
        ),
        Row(
            name="wall time of a cycle of 6 servos, one of them mute",
            unit="ms",
            how=how,
            ours=1000 * wall.median,
            p99=1000 * wall.p99,
            peer=1000 * their_wall.median,
            against=stock,
            most=10,
            most_ratio=0.5,
        ),
        Row(
            name="readings of the other 5 servos that one mute servo costs",
            unit="%",
            how=how,
            ours=_lost(found, others),
            peer=_lost(their_found, others),
            against=stock,
            most=2,
        ),
    ]
