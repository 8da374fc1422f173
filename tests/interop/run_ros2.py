"""The patrol robot against ROS 2 itself, by its command line: `python -m tests.interop.run_ros2`.

It needs ROS 2 with rmw_zenoh_cpp, sourced; elsewhere it says what is missing and ends with code 77. Each step is one
command of `ros2` and what must be in its answer. `docs/interop.md` tells how to run it.
"""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
ROBOT = "robots/turtlebot/robot.yaml"
SKIPPED = 77  # the exit code for a test that could not be run
START = 30.0  # [s] for the robot to come up
LIMIT = 30.0  # [s] for one command


@dataclass(frozen=True, slots=True)
class Step:
    """A command of `ros2` and the words that its output must hold."""

    name: str
    words: tuple[str, ...]
    expected: tuple[str, ...]


NAVIGATE = "nav2_msgs/action/NavigateToPose"
STEPS = (
    Step("nodes are listed", ("node", "list"), ("/base", "/go_to", "/mission")),
    Step("topics are listed with their types", ("topic", "list", "-t"), ("/odom [nav_msgs/msg/Odometry]", "/tf [")),
    Step("qualities and hashes are shown", ("topic", "info", "-v", "/odom"), ("RIHS01_", "RELIABLE")),
    Step("a message of ours is read", ("topic", "echo", "--once", "/odom"), ("frame_id: odom", "child_frame_id")),
    Step("a number is read", ("topic", "echo", "--once", "/battery_level"), ("data:",)),
    Step(
        "a latched message reaches a late subscriber",
        ("topic", "echo", "--once", "--qos-durability", "transient_local", "/tf_static"),
        ("frame_id: map", "child_frame_id: odom"),
    ),
    Step("log lines are read", ("topic", "info", "/rosout"), ("rcl_interfaces/msg/Log",)),
    Step("services are listed", ("service", "list"), ("/battery/set_parameters", "/go_to/get_parameters")),
    Step("parameters are listed", ("param", "list", "/base"), ("max_speed", "command_timeout")),
    Step("a parameter is read", ("param", "get", "/base", "max_speed"), ("0.5",)),
    Step("a parameter is set", ("param", "set", "/base", "max_speed", "0.4"), ("successful",)),
    Step("it stays set", ("param", "get", "/base", "max_speed"), ("0.4",)),
    Step("what is out of range is refused", ("param", "set", "/base", "max_speed", "-1.0"), ("ailed",)),
    Step(
        "a service answers",
        ("service", "call", "/set_battery_level", "rbxcompose_msgs/srv/SetBatteryLevel", "{value: 90.0}"),
        ("response:",),
    ),
    Step("actions are listed with their types", ("action", "list", "-t"), (f"/go_to [{NAVIGATE}]",)),
    Step(
        "a goal is carried out, with feedback",
        (
            *("action", "send_goal", "--feedback", "/go_to", NAVIGATE),
            "{pose: {header: {frame_id: map}, pose: {position: {x: 0.3}, orientation: {w: 1.0}}}}",
        ),
        ("Goal accepted", "distance_remaining", "SUCCEEDED"),
    ),
    Step(
        "commands drive the base through its mux",
        ("topic", "pub", "-r", "10", "-t", "20", "/cmd_vel/teleop", "geometry_msgs/msg/Twist", "{linear: {x: 0.2}}"),
        ("publishing",),
    ),
)
NEEDS = {
    "a service answers": "rbxcompose_msgs",  # `rbxcompose msg export`, built with colcon
    "a goal is carried out, with feedback": "nav2_msgs",
}


def missing() -> str:
    """Return why this machine cannot run it, or nothing."""
    if shutil.which("ros2") is None:
        return "there is no `ros2` command: source the setup file of ROS 2"
    if not has_package("rmw_zenoh_cpp"):
        return "the package rmw_zenoh_cpp is not installed"
    return ""


def has_package(name: str) -> bool:
    """Tell whether ROS 2 knows a package."""
    return subprocess.run(["ros2", "pkg", "prefix", name], capture_output=True).returncode == 0


@contextmanager
def robot(folder: Path) -> Iterator[dict[str, str]]:
    """Bring the patrol robot up without its mission; yield the environment for `ros2` beside it."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
    environment.pop("PYTHONPATH", None)  # that of ROS 2 is for another interpreter
    rbxcompose = [sys.executable, "-m", "rbxcompose"]
    up = [*rbxcompose, "up", ROBOT, "-d", "--set", f"bus.port={port}"]
    subprocess.run(up, cwd=ROOT, env=environment, check=True, timeout=START)
    try:
        subprocess.run([*rbxcompose, "mission", "pause"], cwd=ROOT, env=environment, timeout=LIMIT)
        yield {
            **os.environ,
            "RMW_IMPLEMENTATION": "rmw_zenoh_cpp",
            "ROS_DOMAIN_ID": "0",
            "ZENOH_CONFIG_OVERRIDE": f'connect/endpoints=["tcp/127.0.0.1:{port}"]',
        }
    finally:
        subprocess.run([*rbxcompose, "down"], cwd=ROOT, env=environment, timeout=LIMIT)


def run(step: Step, environment: dict[str, str]) -> str:
    """Carry out a step; return what was wrong, or nothing."""
    try:
        ran = subprocess.run(["ros2", *step.words], env=environment, capture_output=True, text=True, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        return f"no answer within {LIMIT:g} s"
    output = ran.stdout + ran.stderr
    absent = [words for words in step.expected if words not in output]
    return f"{absent} is not in:\n{output}" if absent else ""


def main() -> int:
    """Run all steps and say of each how it went."""
    if reason := missing():
        sys.stdout.write(f"skipped: {reason}\n")
        return SKIPPED
    failed = 0
    with tempfile.TemporaryDirectory(prefix="rbx") as folder, robot(Path(folder)) as environment:
        subprocess.run(["ros2", "daemon", "stop"], env=environment, capture_output=True, timeout=LIMIT)
        time.sleep(1.0)  # liveliness needs a moment to reach a new party
        for step in STEPS:
            if step.name in NEEDS and not has_package(NEEDS[step.name]):
                sys.stdout.write(f"skipped  {step.name}: needs the package {NEEDS[step.name]}\n")
                continue
            wrong = run(step, environment)
            failed += bool(wrong)
            sys.stdout.write(f"{'FAILED' if wrong else 'ok':<8} {step.name}\n{wrong}")
    sys.stdout.write(f"{len(STEPS) - failed} of {len(STEPS)} steps without a failure\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
