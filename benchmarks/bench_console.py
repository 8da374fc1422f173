"""The console: what clients of a running robot cost, how fast they are served, how soon a browser shows the page.

rosbridge_suite is not installable beside this project; its figures, measured on machines like ours, are in the bars.
"""

from __future__ import annotations

import asyncio
import gzip
import json
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

from benchmarks.measuring import COMMAND, ROOT, Row, Samples, memory_of, processor_time, program
from benchmarks.peers import free_port

MEASURES = ("rbxcompose/domains/console", "console/src")

MANIFEST = """rbx: 1
kind: Robot
name: benchmark_of_the_console
bus: {{port: {bus}}}
console: {{port: {port}}}
components:
  battery: {{type: battery_sim, runtime: 45 s}}
  base: {{type: diff_drive_sim}}
"""
CLIENTS, LOOK = 20, 10.0  # [s] for which they look
MANY = 50
ROUND_TRIPS = 15
STATIC = ROOT / "rbxcompose/domains/console/static"


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot that is up, and the process of its gateway."""

    port: int
    gateway: int


@contextmanager
def _robot() -> Iterator[Robot]:
    with TemporaryDirectory() as folder:
        port, base = free_port(), Path(folder)
        (base / "robot.yaml").write_text(MANIFEST.format(port=port, bus=free_port()), encoding="utf-8")
        environment = {"XDG_RUNTIME_DIR": folder}
        program([*COMMAND, "up", "-d", folder], environment)()
        try:
            state = json.loads(str(program([*COMMAND, "ps", "--json"], environment)()))
            found = [one["pid"] for one in state["components"] if one["name"] == "gateway"]
            yield Robot(port, int(found[0]))
        finally:
            program([*COMMAND, "down"], environment)()


def _client(robot: Robot) -> Any:
    return connect(f"ws://127.0.0.1:{robot.port}/rosbridge", max_size=None, compression=None)


async def _subscribes(socket: ClientConnection, topic: str, throttle: int) -> None:
    frame = {"op": "subscribe", "topic": topic, "throttle_rate": throttle, "queue_length": 1}
    await socket.send(json.dumps(frame))


async def _looking(robot: Robot) -> tuple[float, float]:
    """Return the share of a core and the memory [MB] of the gateway while clients look at what a page shows."""
    sockets = [await _client(robot) for _ in range(CLIENTS)]
    for socket in sockets:
        for topic in ("/odom", "/battery_level", "/diagnostics_toplevel_state"):
            await _subscribes(socket, topic, 100)

    async def read(socket: ClientConnection) -> None:
        async for _ in socket:
            pass

    readers = [asyncio.ensure_future(read(socket)) for socket in sockets]
    await asyncio.sleep(1)
    before, began = processor_time(robot.gateway), time.monotonic()
    await asyncio.sleep(LOOK)
    share = (processor_time(robot.gateway) - before) / (time.monotonic() - began)
    memory = memory_of(robot.gateway) / 1e6
    for reader, socket in zip(readers, sockets, strict=True):
        reader.cancel()
        await socket.close()
    return share, memory


async def _idle(robot: Robot) -> float:
    await asyncio.sleep(1)
    before, began = processor_time(robot.gateway), time.monotonic()
    await asyncio.sleep(LOOK)
    return (processor_time(robot.gateway) - before) / (time.monotonic() - began)


async def _connecting(robot: Robot) -> float:
    """Return how long many clients take to connect at once, each with an answer [s]."""

    async def one() -> ClientConnection:
        socket: ClientConnection = await _client(robot)
        await socket.send(json.dumps({"op": "call_service", "service": "/rosapi/get_time", "id": "a"}))
        await socket.recv()
        return socket

    began = time.monotonic()
    sockets = await asyncio.gather(*(one() for _ in range(MANY)))
    took = time.monotonic() - began
    await asyncio.gather(*(socket.close() for socket in sockets))
    return took


async def _round_trips(robot: Robot) -> list[float]:
    """Return how long a text of 1 MiB takes to the bus and back [s]."""
    text, times = "x" * 2**20, []
    async with _client(robot) as socket:
        await socket.send(json.dumps({"op": "advertise", "topic": "/text", "type": "std_msgs/String"}))
        await socket.send(json.dumps({"op": "subscribe", "topic": "/text", "type": "std_msgs/String"}))
        await asyncio.sleep(0.5)
        frame = json.dumps({"op": "publish", "topic": "/text", "msg": {"data": text}})
        for _ in range(ROUND_TRIPS):
            began = time.monotonic()
            await socket.send(frame)
            while len(await socket.recv()) < len(text):
                pass
            times.append(time.monotonic() - began)
    return times


async def _gap(robot: Robot) -> float:
    """Return the longest gap of a reader of 50 Hz [s] beside one that subscribes to everything and never reads."""
    slow = await connect(f"ws://127.0.0.1:{robot.port}/rosbridge", max_size=None, max_queue=1, compression=None)
    for topic in ("/odom", "/tf", "/diagnostics", "/rosout"):
        await slow.send(json.dumps({"op": "subscribe", "topic": topic}))
    async with _client(robot) as reader:
        await reader.send(json.dumps({"op": "subscribe", "topic": "/odom"}))
        await reader.recv()
        end, last, longest = time.monotonic() + LOOK / 2, time.monotonic(), 0.0
        while time.monotonic() < end:
            await reader.recv()
            longest, last = max(longest, time.monotonic() - last), time.monotonic()
    await slow.close()
    return longest


def _first_paint(robot: Robot) -> list[float]:
    """Return when a browser has painted the page for the first time [s]; nothing without one."""
    chromium = shutil.which("chromium") or shutil.which("chromium-headless-shell")
    if chromium is None:
        return []
    from playwright.sync_api import sync_playwright

    times = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for _ in range(3):
            page = browser.new_page()
            page.goto(f"http://127.0.0.1:{robot.port}/")
            page.get_by_text("Connected", exact=True).wait_for()
            times.append(page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime") / 1000)
            page.close()
        browser.close()
    return times


def _page_size() -> float:
    """Return the page with all that it loads at any time, compressed [MB]."""
    files = [path for path in STATIC.rglob("*") if path.suffix in (".js", ".css", ".html")]
    return sum(len(gzip.compress(path.read_bytes())) for path in files) / 1e6


def rows() -> list[Row]:
    """Return the figures of the console."""
    with _robot() as robot:
        idle = asyncio.run(_idle(robot))
        connecting = asyncio.run(_connecting(robot))
        share, memory = asyncio.run(_looking(robot))
        trips = Samples(tuple(asyncio.run(_round_trips(robot))))
        gap = asyncio.run(_gap(robot))
        paints = _first_paint(robot)
    how = f"{CLIENTS} clients, three topics at 10 Hz each; {os.cpu_count()} cores"
    found = [
        Row("console: share of a core", "%", how, share * 100, most=5),
        Row("console: memory of the gateway", "MB", how, memory, most=120),
        Row("console: share of a core while nobody looks", "%", "no client", idle * 100, most=1),
        Row("console: clients connected", "s", f"{MANY} at once, each with an answer", connecting, most=0.3),
        Row("console: text of 1 MiB to the bus and back", "ms", "", trips.median * 1e3, trips.p99 * 1e3, most=66),
        Row("console: longest gap beside a slow reader", "ms", "a topic of 50 Hz", gap * 1e3, most=50),
        Row("console: page, compressed", "MB", "without meshes", _page_size(), most=1),
    ]
    if paints:
        found.append(Row("console: first paint", "s", "Chromium", Samples(tuple(paints)).median, most=1.5))
    return found
