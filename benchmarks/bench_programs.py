"""Programs of others: the bridge to a ROS 2 with Fast DDS, beside two nodes of that ROS 2 without it.

It needs the ROS 2 that `make ros2` installs.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measuring import COMMAND, ROOT, Row, Samples, processor_time, program
from benchmarks.peers import free_port
from rbxcompose.bus.names import data_key
from rbxcompose.commands.guest import Guest
from rbxcompose.commands.lookup import BusPlace
from rbxcompose.msgs.sensor_msgs import Image
from rbxcompose.sdk.ports import Qos

MEASURES = ("rbxcompose/domains/programs",)
ROS, ENDS, DOMAIN = ROOT / ".ros2/bin/python", ROOT / "benchmarks/programs_ends.py", 91
LOOK = 5.0  # [s]
MANIFEST = """rbx: 1
kind: Robot
name: benchmark_of_programs
bus: {{port: {bus}}}
ros2: {{python: {ros}, domain: {domain}}}
components:
  echo:
    type: program
    command: [{python}, {echo}]
    subscribes: {{bridge_cmd: geometry_msgs/Twist}}
    publishes: {{bridge_odom: nav_msgs/Odometry}}
  ros:
    type: ros2_node
    publishes:
      bridge_cmd: geometry_msgs/Twist
      flood: {{type: geometry_msgs/Twist, qos: state}}
      images: sensor_msgs/Image
    subscribes: {{bridge_odom: {{type: nav_msgs/Odometry, qos: command}}}}
  sink: {{type: topic_monitor, topic: flood, message: geometry_msgs/Twist, rate: 1 Hz}}
"""


@contextmanager
def _robot() -> Iterator[tuple[int, list[int]]]:
    """Yield the port of the bus and the processes of the bridge: ours, and that in ROS's Python."""
    with TemporaryDirectory() as folder:
        bus, base = free_port(), Path(folder)
        echo = ROOT / "benchmarks/programs_echo.py"
        text = MANIFEST.format(bus=bus, ros=ROS, domain=DOMAIN, python=sys.executable, echo=echo)
        (base / "robot.yaml").write_text(text, encoding="utf-8")
        environment = {"XDG_RUNTIME_DIR": folder}
        program([*COMMAND, "up", "-d", folder], environment)()
        try:
            state = json.loads(str(program([*COMMAND, "ps", "--json"], environment)()))
            ours = next(int(one["pid"]) for one in state["components"] if one["name"] == "ros")
            theirs = int(subprocess.check_output(["pgrep", "-f", "ros_side.py"]).split()[0])
            yield bus, [ours, theirs]
        finally:
            program([*COMMAND, "down"], environment)()


@contextmanager
def _ros(role: str) -> Iterator[subprocess.Popen[bytes]]:
    environment = {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    environment.pop("PYTHONPATH", None)
    running = subprocess.Popen([ROS, ENDS, role], env=environment, stdout=subprocess.PIPE)
    try:
        yield running
    finally:
        running.send_signal(signal.SIGTERM)
        running.wait()


def _share(processes: list[int]) -> float:
    """Return the share of a core that processes take."""
    time.sleep(1.5)  # until discovery is over
    before = [processor_time(pid) for pid in processes]
    time.sleep(LOOK)
    return sum(processor_time(pid) - start for pid, start in zip(processes, before, strict=True)) / LOOK


def _images(bus: int) -> float:
    """Return how many MB a second of images come out of the bridge."""
    size = 0

    with Guest(BusPlace(f"tcp/127.0.0.1:{bus}"), stays=True) as guest:

        def arrived(arrival: object) -> None:
            nonlocal size
            size += len(arrival.payload)  # type: ignore[attr-defined]

        guest.transport.subscribe(data_key(0, "/images", Image.TYPE, Image.HASH), Qos.BULK, arrived)
        time.sleep(1.5)
        before = size
        time.sleep(LOOK)
        return (size - before) / LOOK / 1e6


def rows() -> list[Row]:
    """Return the figures of the bridge; none without a ROS 2."""
    if not ROS.exists():
        return []
    with _robot() as (bus, processes):
        idle = _share(processes)
        with _ros("echo"), _ros("ping") as ping:
            took = json.loads(ping.communicate()[0])
        with _ros("flood"):
            share = _share(processes)
        with _ros("images"), _ros("images"):  # one alone does not send more than 29 MB/s
            rate = _images(bus)
    bridge, peer = Samples(tuple(took["bridge"])), Samples(tuple(took["peer"]))
    how = "rclpy with Fast DDS; a program with bare Zenoh answers"
    return [
        Row(
            "bridge: velocity there, odometry back",
            "ms",
            how,
            bridge.median * 1e3,
            bridge.p99 * 1e3,
            peer.median * 1e3,
            "two nodes of rclpy, in turns",
            most_ratio=2,
        ),
        Row(
            "bridge: share of a core",
            "%",
            "1,000 velocities a second from ROS; both its processes",
            share * 100,
            most=15,
        ),
        Row("bridge: share of a core while nothing passes", "%", "", idle * 100),
        Row("bridge: images", "MB/s", "640 x 480, twice 20 a second are sent", rate, least=30),
    ]
