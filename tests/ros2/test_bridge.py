"""A robot and a real node of ROS 2 on Fast DDS, through the bridge: topics, services, actions, parameters, faults."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.bus.actions import ActionServer
from rbxcompose.commands.guest import Guest
from rbxcompose.msgs import registry
from rbxcompose.runtime.processes import Process
from rbxcompose.sdk.ports import Qos
from tests.cli.live_robot import Robot
from tests.console.test_gateway_live import free_port
from tests.soak import Soak, rare

HERE = Path(__file__).parent
DOMAIN = 57
MANIFEST = """rbx: 1
kind: Robot
name: beside_ros
bus: {{port: {bus}}}
ros2: {{python: {python}, domain: {domain}}}
msgs: {{own: {own}}}
components:
  base:
    type: program
    command: [{ours}, {base}]
    subscribes: {{cmd_vel: geometry_msgs/Twist}}
    publishes:
      odom: {{type: nav_msgs/Odometry, rate: 40 Hz}}
      /tf: tf2_msgs/TFMessage
      uptime: test_msgs/Builtins
    ready: {{topic: odom}}
    capabilities:
      frames: {{base_footprint: odom}}
      drives: {{odometry: odom, max_speed: 0.5 m/s, max_turn_rate: 90 deg/s, stops_after: 0.5 s}}
  go_to: {{type: go_to, speed: 0.3 m/s}}
  somebody:
    type: ros2_node
    command: [python3, {node}]
    restart: always
    parameters: {{gain: 0.5}}
    publishes:
      cmd_vel_ros: {{type: geometry_msgs/Twist, rate: 15 Hz}}
      answered: test_msgs/Builtins
      plan: {{type: std_msgs/String, qos: latched}}
      uptime_seen: test_msgs/Builtins
    subscribes:
      odom: nav_msgs/Odometry
      uptime: test_msgs/Builtins
      asked: test_msgs/Builtins
    serves: {{beep: std_srvs/Trigger, retune: std_srvs/Trigger, chase: std_srvs/Trigger}}
    serves_actions: {{count: test_msgs/Fibonacci}}
    calls_actions: {{ours: test_msgs/Fibonacci}}
    configures: [go_to]
    capabilities: {{commands_motion: {{commands: cmd_vel_ros, max_speed: 0.3 m/s}}}}
muxes:
  cmd_vel:
    inputs:
      ros: {{topic: cmd_vel_ros, priority: 10, timeout: 0.5 s}}
      navigation: {{from: go_to, priority: 20, timeout: 0.5 s}}
values:
  answer: {{topic: answered, field: duration_value.sec}}
missions: {{ask: ask.yaml}}
"""
MISSION = """rbx: 1
kind: Mission
name: ask
do:
  - publish: asked
    message: {duration_value: {sec: 9}}
  - wait_for: $answer == 9
    timeout: 10 s
  - count: 2
"""


@pytest.fixture
def own_types() -> Iterator[None]:
    """Let names mean the types of the robot, here as well."""
    own = HERE / "own"
    texts = {f"{path.parts[-3]}/{path.parts[-2]}/{path.stem}": path.read_text() for path in own.glob("*/*/*")}
    with registry.choosing(texts):
        yield


@pytest.fixture(scope="module")
def robot(ros2_python: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    text = MANIFEST.format(
        bus=free_port(),
        python=ros2_python,
        domain=DOMAIN,
        own=HERE / "own/test_msgs",
        node=HERE / "node.py",
        ours=sys.executable,
        base=HERE.parent / "programs/bare_base.py",
    )
    made, before = Robot(tmp_path_factory.mktemp("ros"), text), shared_memory()
    (made.file.parent / "ask.yaml").write_text(MISSION)
    up = made.do("up", "-d", str(made.file))
    assert up.returncode == 0, up.stdout + up.stderr
    try:
        called = made.do("service", "call", "beep")  # at once, before ROS has found its server
        assert "true" in called.stdout, called.stderr
        yield made
    finally:
        made.do("down")
    used = in_use()
    for path in shared_memory() - before:  # Fast DDS leaves what killed nodes had
        if str(path).removesuffix("_el") not in used:
            path.unlink(missing_ok=True)


def shared_memory() -> set[Path]:
    return set(Path("/dev/shm").glob("*fastdds_*"))


def in_use() -> set[str]:
    """Return the files in shared memory that a process has."""
    found = set[str]()
    for path in Path("/proc").glob("[0-9]*/maps"):
        with suppress(OSError):  # it has ended
            found |= {line.split()[-1] for line in path.read_text().splitlines() if "/dev/shm/" in line}
    return found


def until(robot: Robot, holds: object, within: float = 60.0) -> None:
    """Ask again until something holds; it must within so many seconds."""
    deadline = time.monotonic() + within
    while time.monotonic() < deadline:
        if holds():  # type: ignore[operator]
            return
        time.sleep(0.05)
    raise AssertionError(robot.do("logs").stdout)


def x_of(robot: Robot) -> float:
    return float(robot.told("topic", "echo", "odom", "--once")["pose"]["pose"]["position"]["x"])


def test_its_velocities_move_the_base_through_the_mux_and_odometry_comes_back(robot: Robot) -> None:
    before = x_of(robot)
    until(robot, lambda: x_of(robot) > before + 0.05)
    assert robot.told("service", "call", "beep")["message"].startswith("True")


def test_the_robot_knows_its_ends_under_the_name_of_the_component(robot: Robot) -> None:
    shown = robot.do("topic", "info", "cmd_vel_ros").stdout
    assert "/somebody" in shown
    assert "geometry_msgs/msg/Twist" in shown


def test_a_message_of_the_user_passes_both_ways(robot: Robot) -> None:
    words = "{duration_value: {sec: 7}}"
    listening = subprocess.Popen(
        robot.command("topic", "echo", "answered", "--once", "--json"), env=robot.environment, stdout=subprocess.PIPE
    )
    until(
        robot, lambda: robot.do("topic", "pub", "asked", "test_msgs/Builtins", words) and listening.poll() is not None
    )
    out, _ = listening.communicate()
    assert json.loads(out)["duration_value"]["sec"] == 7


def test_a_message_of_the_user_passes_between_two_programs_of_others(robot: Robot) -> None:
    assert robot.told("topic", "echo", "uptime_seen", "--once")["duration_value"]["sec"] == 7


def test_a_mission_sends_and_understands_messages_of_the_user_and_uses_skills_there(robot: Robot) -> None:
    assert robot.do("mission", "run", "ask").returncode == 0
    until(robot, lambda: "ask: success" in robot.do("logs").stdout)


def test_what_it_published_before_we_came_is_there(robot: Robot) -> None:
    assert "the only one" in robot.do("topic", "echo", "plan", "--once").stdout


def test_parameters_are_set_in_both_directions(robot: Robot) -> None:
    assert robot.told("service", "call", "beep")["message"] == "True 0.5"
    assert robot.do("param", "set", "somebody", "gain", "0.75").returncode == 0
    assert robot.told("service", "call", "beep")["message"] == "True 0.75"
    assert robot.told("service", "call", "retune") == {"success": True, "message": ""}
    assert "0.25 m/s" in robot.do("param", "get", "go_to", "speed").stdout


def test_a_goal_of_ours_is_carried_out_there(robot: Robot) -> None:
    done = robot.do("action", "send", "count", "{order: 4}")
    assert done.returncode == 0, done.stderr
    assert "[0, 1, 1, 2, 3, 5]" in done.stdout


def test_a_goal_of_theirs_is_carried_out_here(robot: Robot, own_types: None) -> None:
    fibonacci = registry.action("test_msgs/Fibonacci")
    with Guest(robot.place(), stays=True) as guest:
        server: ActionServer = guest.bus().serve_action("test", "/ours", fibonacci, lambda goal: "")  # type: ignore[type-arg]

        def carry_out() -> None:
            if server.current is not None:
                server.current.feedback(fibonacci.Feedback(sequence=(0,)))
                server.current.succeeded(fibonacci.Result(sequence=(0, server.current.request.order)))

        def began() -> None:
            guest.scheduler.post("test", carry_out)

        server.began = began
        asking = subprocess.Popen(
            robot.command("service", "call", "chase", "--json"), env=robot.environment, stdout=subprocess.PIPE
        )
        guest.scheduler.every(0.1, "test", lambda dt: None)  # looks whether it has ended
        guest.run(lambda: asking.poll() is not None, 10.0)
    assert json.loads(asking.communicate()[0])["message"] == "[0, 3]"


def test_nothing_comes_back_that_was_sent(robot: Robot, own_types: None) -> None:
    """A topic that passes to ROS has one publisher there and comes back from nobody."""
    arrived: list[bytes] = []
    with Guest(robot.place(), stays=True) as guest:
        builtins = registry.message("test_msgs/Builtins")
        key = guest.bus()  # the same session publishes and listens
        key.subscribe("test", "/asked", builtins, Qos.EVENT, lambda message: arrived.append(b""))
        publisher = key.publisher("test", "/asked", builtins, Qos.EVENT)
        guest.run(lambda: False, 0.5)
        publisher(builtins())
        guest.run(lambda: False, 1.0)
    assert len(arrived) == 1  # our own


def test_what_ros_has_is_listed_and_pinned(robot: Robot, tmp_path: Path, soak: Soak) -> None:
    listed = robot.told("ros2", "scan", str(robot.file))
    node = next(one for one in listed if one["node"] == "/somebody")
    assert node["publishes"]["/cmd_vel_ros"] == "geometry_msgs/Twist"
    assert node["serves_actions"] == {"/count": "test_msgs/Fibonacci"}
    assert node["latched"] == ["/plan"]
    file = tmp_path / "robot.yaml"
    head = robot.file.read_text().partition("    publishes:\n      cmd_vel_ros")[0]
    file.write_text(f"{head}  # the end\n")
    pinned = robot.do("ros2", "pin", "somebody", "somebody", str(file))
    assert pinned.returncode == 0, pinned.stderr
    assert "plan: {type: std_msgs/String, qos: latched}" in file.read_text()
    assert file.read_text().endswith("  # the end\n")
    assert "error" not in robot.do("check", str(file)).stdout
    if soak.is_on:
        assert "declares all" in robot.do("ros2", "pin", "somebody", "somebody", str(file)).stdout


@pytest.mark.parametrize("what", ["node.py", *rare("ros_side.py")])
def test_a_side_that_is_killed_comes_back_and_meanwhile_the_base_rests(robot: Robot, what: str) -> None:
    until(robot, lambda: pids_of(robot, what))
    restarted = int(somebody(robot)["restarts"])
    for pid in pids_of(robot, what):
        os.kill(pid, signal.SIGKILL)
    until(robot, lambda: int(somebody(robot)["restarts"]) > restarted)
    before = x_of(robot)
    until(robot, lambda: x_of(robot) > before + 0.05)
    assert "was killed by SIGKILL" in robot.do("logs").stdout


def somebody(robot: Robot) -> dict[str, Any]:
    return next(one for one in robot.told("ps")["components"] if one["name"] == "somebody")


def pids_of(robot: Robot, what: str) -> list[int]:
    return [pid for pid in descendants(somebody(robot)["pid"]) if what in command_of(pid)]


def descendants(pid: int) -> Iterator[int]:
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in (task / "children").read_text().split():
            yield int(child)
            yield from descendants(int(child))


def command_of(pid: int) -> str:
    return Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")


def test_nothing_is_left_after_down(robot: Robot) -> None:
    left = [Process.of(pid) for pid in descendants(somebody(robot)["pid"])]
    down = robot.do("down")
    assert down.returncode == 0, down.stderr
    until(robot, lambda: not any(one.is_running for one in left), within=1.0)  # the kernel ends some with their parent


OTHER = """rbx: 1
kind: Robot
name: other_definitions
bus: {{port: {bus}}}
ros2: {{python: {python}, domain: {domain}}}
msgs: {{own: own}}
components:
  stranger:
    type: ros2_node
    publishes: {{strange: test_msgs/Builtins}}
    serves: {{also_strange: test_msgs/Missing}}
"""


def test_types_that_ros_defines_otherwise_or_does_not_have_are_told(ros2_python: Path, tmp_path: Path) -> None:
    folder = tmp_path / "own/test_msgs"
    for name, text in {"msg/Builtins.msg": "int32 sec\n", "srv/Missing.srv": "---\nbool success\n"}.items():
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_text(text)
    robot = Robot(tmp_path, OTHER.format(bus=free_port(), python=ros2_python, domain=DOMAIN))
    try:
        up = robot.do("up", "-d", str(robot.file))
        assert up.returncode == 0, up.stderr
        until(robot, lambda: "test_msgs/srv/Missing" in robot.do("logs").stdout)
        assert "another definition of test_msgs/msg/Builtins" in robot.do("logs").stdout
    finally:
        robot.do("down")
