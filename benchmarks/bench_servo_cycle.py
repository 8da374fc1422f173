"""A robot with 20 servos in real processes: how well its driver keeps 100 Hz, alone and beside a busy program.

The servos are simulated by bytes on a pseudo-terminal, with wire time, in a process of their own.
"""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.synchronize import Event
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.bench_robot import up
from benchmarks.measuring import COMMAND, Row, program
from rbxcompose.testing import FakeLine, FakePort, FakeServo

MEASURES = ("rbxcompose/runtime", "rbxcompose/domains/servos")

SERVOS, RATE = 20, 100  # [Hz]
SECONDS = 20.0
MODEL = "XL430-W250"
LIMIT = '<limit lower="-2" upper="2" effort="1" velocity="2"/>'


def rows() -> list[Row]:
    """Return the share of periods that were met, and how late cycles began."""
    return [row for busy in (0, 1) for row in _measured(busy)]


def _measured(busy: int) -> list[Row]:
    with TemporaryDirectory() as folder, _served(Path(folder) / "servos"), _neighbours(busy):
        _write(Path(folder))
        environment = {"XDG_RUNTIME_DIR": folder}
        with up(f"{folder}/robot.yaml", environment, "--real"):
            time.sleep(SECONDS)
            status = _status(environment)
    beside = f", beside {busy} busy program{'s' if busy > 1 else ''}" if busy else ""
    how = f"1 Mbit/s, {RATE} Hz for {SECONDS:g} s, real processes; from the diagnostics of the driver"
    met, late = (float(status[name].split()[0]) for name in ("periods_met", "late"))
    return [
        Row(name=f"periods met by the driver of 20 servos{beside}", unit="%", how=how, ours=met, least=99),
        Row(name=f"how late its cycles begin{beside}, 99 of 100", unit="ms", how=how, ours=late),
    ]


def _write(folder: Path) -> None:
    numbers = range(1, SERVOS + 1)
    links = "".join(f'<link name="link_{n}"/>' for n in (0, *numbers))
    joints = "".join(
        f'<joint name="joint_{n}" type="revolute"><parent link="link_{n - 1}"/><child link="link_{n}"/>'
        f'<axis xyz="0 0 1"/>{LIMIT}</joint>'
        for n in numbers
    )
    (folder / "robot.urdf").write_text(f'<robot name="bench">{links}{joints}</robot>', encoding="utf-8")
    robot = {
        "rbx": 1,
        "kind": "Robot",
        "name": "bench_servos",
        "body": {"urdf": "robot.urdf"},
        "buses": {"servos": {"type": "dynamixel", "port": str(folder / "servos"), "rate": f"{RATE} Hz"}},
        "actuators": {f"servo_{n}": {"bus": "servos", "model": MODEL, "id": n} for n in numbers},
        "joints": {f"joint_{n}": {"actuator": f"servo_{n}"} for n in numbers},
    }
    (folder / "robot.yaml").write_text(json.dumps(robot), encoding="utf-8")


def _status(environment: dict[str, str]) -> dict[str, str]:
    command = [*COMMAND, "topic", "echo", "/diagnostics", "--json", "-n", "12"]
    for line in str(program(command, environment)()).splitlines():
        for status in json.loads(line)["status"]:
            found = {pair["key"]: pair["value"] for pair in status["values"]}
            if "periods_met" in found:
                return found
    raise RuntimeError("the driver of the servos told nothing")


@contextmanager
def _served(path: Path) -> Iterator[None]:
    ready = multiprocessing.Event()
    with _running(_serve, path, ready):
        ready.wait()
        yield


def _serve(path: Path, ready: Event) -> None:
    """Answer as hardware does, which no program holds up: with real-time priority, where that is permitted."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(2))
    servos = [FakeServo(MODEL, number) for number in range(1, SERVOS + 1)]
    for servo in servos:
        servo.set("return_delay", 0)
    with FakePort(FakeLine(servos, time.monotonic), path, has_wire_time=True):
        ready.set()
        time.sleep(10 * SECONDS)


@contextmanager
def _neighbours(count: int) -> Iterator[None]:
    if not count:
        yield
        return
    with _running(_spin), _neighbours(count - 1):
        yield


def _spin() -> None:
    while True:
        pass


@contextmanager
def _running(target: object, *arguments: object) -> Iterator[None]:
    process = multiprocessing.Process(target=target, args=arguments, daemon=True)  # type: ignore[arg-type]
    process.start()
    try:
        yield
    finally:
        process.kill()
        process.join()
