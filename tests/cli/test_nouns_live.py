"""Topics, services, actions, frames and the keyboard, on a robot in real processes."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rbxcompose.bus.graph import find
from rbxcompose.commands.guest import Guest, ReceivedMessage
from rbxcompose.msgs.cdr import decode
from rbxcompose.msgs.geometry_msgs import Twist
from tests.cli.live_robot import PATIENCE, Keyboard, Robot
from tests.conftest import ROOT
from tests.forked import Forked
from tests.soak import rare

FAR = "{pose: {header: {frame_id: map}, pose: {position: {x: 50}, orientation: {w: 1}}}}"
NEAR = "{pose: {header: {frame_id: map}, pose: {orientation: {w: 1}}}}"


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(base, (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8").partition("\nmissions:")[0])
    up = made.do("up", "-d", str(made.file), "--set", "bus.port=7890")
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


def test_topics_are_listed_with_their_types(robot: Robot) -> None:
    listed = {entry["name"]: entry for entry in robot.told("topic", "ls")}
    assert listed["/odom"]["types"] == ["nav_msgs/msg/Odometry"]
    assert listed["/cmd_vel/teleop"] == {
        "name": "/cmd_vel/teleop",
        "types": ["geometry_msgs/msg/Twist"],
        "clash": "",
        "publishers": 0,
        "subscriptions": 1,
    }
    assert not any("_action" in name for name in listed)
    assert "/go_to/_action/feedback" in robot.do("topic", "ls", "--all").stdout


def test_a_topic_is_shown_with_its_ends(robot: Robot) -> None:
    shown = robot.told("topic", "show", "odom")
    assert [end["node"] for end in shown["publishers"]] == ["/base"]
    assert "publisher  /base  nav_msgs/msg/Odometry  reliable, newest 10" in robot.do("topic", "show", "odom").stdout


def test_a_misspelt_topic_is_told_what_was_probably_meant(robot: Robot) -> None:
    done = robot.do("topic", "echo", "/odo")
    assert (done.returncode, "RBX9022" in done.stderr, "did you mean '/odom'?" in done.stderr) == (1, True, True)


def test_messages_are_printed(robot: Robot) -> None:
    lines = robot.do("topic", "echo", "/odom", "-n", "2", "--json").stdout.splitlines()
    assert [json.loads(line)["header"]["frame_id"] for line in lines] == ["odom", "odom"]
    assert "child_frame_id: base_footprint" in robot.do("topic", "echo", "/odom", "--once").stdout


def test_what_was_latched_is_printed_to_who_comes_later(robot: Robot) -> None:
    assert robot.told("topic", "echo", "/tf_static", "--once")["transforms"][0]["child_frame_id"] == "odom"


def test_the_rate_of_a_topic_is_measured(robot: Robot) -> None:
    pace = robot.told("topic", "hz", "/odom", "--for", "0.6s")
    assert 30.0 < pace["rate"] < 70.0
    assert pace["shortest"] <= 1 / pace["rate"] <= pace["longest"]


def test_what_is_published_arrives(robot: Robot) -> None:
    with Guest(robot.place()) as guest:
        topic = find(guest.graph().topics, "/cmd_vel/teleop")
        assert topic is not None
        heard: list[ReceivedMessage] = []
        guest.listen(topic, heard.append)
        words = ("/cmd_vel/teleop", "geometry_msgs/Twist", "{angular: {z: 0.25}}", "--rate", "50Hz", "-n", "3")
        assert robot.told("topic", "pub", *words)["sent"] == 3
        assert guest.run(lambda: len(heard) == 3, PATIENCE)
    assert {decode(Twist, message.arrival.payload).angular.z for message in heard} == {0.25}


def test_who_publishes_to_nobody_is_told_so(robot: Robot) -> None:
    done = robot.do("topic", "pub", "/nobody", "std_msgs/Empty", "--timeout", "0.2s")
    assert "RBX9025]: nothing subscribes to '/nobody'" in done.stderr
    done = robot.do("topic", "pub", "/odom", "std_msgs/Empty", "--timeout", "0.2s")
    assert done.returncode == 1
    done = robot.do("topic", "pub", "/cmd_vel/teleop", "std_msgs/Empty", "--timeout", "0.2s")
    assert "is not of type std_msgs/msg/Empty, but geometry_msgs/msg/Twist" in done.stderr
    assert "'_rbxcompose' publishes" not in robot.do("logs").stdout


def test_a_service_is_called(robot: Robot) -> None:
    listed = {entry["name"]: entry["types"] for entry in robot.told("service", "ls")}
    assert listed["/set_battery_level"] == ["rbxcompose_msgs/srv/SetBatteryLevel"]
    assert robot.told("service", "call", "set_battery_level", "{value: 55}") == {}
    assert 50.0 < robot.told("topic", "echo", "/battery_level", "--once")["data"] <= 55.0
    done = robot.do("service", "call", "set_battery_level", "{value: many}")
    assert (done.returncode, "RBX9024" in done.stderr) == (1, True)


def test_a_goal_is_sent_and_its_result_printed(robot: Robot) -> None:
    assert [entry["name"] for entry in robot.told("action", "ls")] == ["/go_to", "/recharge"]
    done = robot.do("action", "send", "go_to", NEAR, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["result"]["error_code"] == 0


def test_an_interrupt_cancels_the_goal(robot: Robot) -> None:
    words = robot.command("action", "send", "/go_to", FAR, "--json")
    with Forked(
        words, env=robot.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    ) as sending:
        assert sending.stdout is not None
        assert sending.stderr is not None
        assert "feedback" in json.loads(sending.stdout.readline())
        sending.send_signal(signal.SIGINT)
        rest = sending.stdout.read()
        assert sending.stderr.read() == "'/go_to': canceled\n"
        assert sending.wait(PATIENCE) == 130
    assert "result" in json.loads(rest.splitlines()[-1])


def test_the_tree_of_frames_is_shown(robot: Robot) -> None:
    links = {entry["frame"]: entry for entry in robot.told("tf", "tree")}
    assert (links["odom"]["parent"], links["odom"]["is_static"]) == ("map", True)
    assert (links["base_footprint"]["parent"], links["base_footprint"]["is_static"]) == ("odom", False)
    assert robot.do("tf").stdout.startswith("map\n  odom  (static: x 0 m")
    assert len(robot.told("tf", "echo", "map", "base_footprint", "--once")["translation"]) == 3
    assert (
        "did you mean 'base_footprint'?" in robot.do("tf", "echo", "map", "base_footprin", "--timeout", "0.5s").stderr
    )


def test_where_a_frame_was_is_shown_and_who_asks_for_too_much_is_told_what_is_known(robot: Robot) -> None:
    assert len(robot.told("tf", "echo", "map", "base_footprint", "--once", "--at", "-100ms")["translation"]) == 3
    assert robot.told("tf", "echo", "map", "odom", "--once", "--at", "-1h")["is_static"]
    words = ("tf", "echo", "map", "base_footprint", "--once", "--timeout", "0.1s")
    assert "must not be in the future" in robot.do(*words, "--at", "1s").stderr
    assert "'base_footprint' in 'odom' is known only from" in robot.do(*words, "--at", "-1h").stderr
    with publishing(robot, "map", "moon"), publishing(robot, "sun", "mars"):
        done = robot.do("tf", "echo", "moon", "mars", "--timeout", "0.5s")
    assert "RBX9025]: 'moon' and 'mars' are not connected: the root of 'moon' is 'map', that of 'mars' is 'sun'" in (
        done.stderr
    )


@contextmanager
def publishing(robot: Robot, *words: str) -> Iterator[None]:
    """Place a frame, with `tf static`, until the end of the block."""
    command = robot.command("tf", "static", *words)
    with Forked(command, env=robot.environment, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == f"'{words[1]}' is in '{words[0]}'; Ctrl-C ends it\n"
        yield
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0


def test_a_static_frame_is_in_the_tree_while_it_is_published(robot: Robot) -> None:
    with publishing(robot, "base_footprint", "laser", "--z", "20cm", "--x", "-5mm", "--yaw", "-90deg"):
        placed = next(entry for entry in robot.told("tf", "tree") if entry["frame"] == "laser")
        assert (placed["parent"], placed["is_static"]) == ("base_footprint", True)
        assert (placed["translation"], placed["yaw"]) == ([-0.005, 0.0, 0.2], -90.0)
        again = robot.do("tf", "static", "odom", "laser")
    assert "RBX9043]: 'laser' is already placed in 'base_footprint', by another 'rbxcompose tf static'" in again.stderr
    assert "laser" not in robot.do("tf", "tree").stdout


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("base_footprint", "base_footprint"), "that is 'base_footprint' itself or is below it"),
        (("map", "base_footprint"), "'base_footprint' is already placed in 'odom', by /base"),
        (("odom", "map"), "that is 'map' itself or is below it"),
        (("/map", "laser"), "names of frames do not begin with '/'"),
        (("map", ""), "a frame needs a name"),
    ],
    ids=["itself", "taken", "cycle", "slash", "nameless"],
)
def test_what_would_not_be_a_tree_is_not_published(robot: Robot, words: tuple[str, str], reason: str) -> None:
    done = robot.do("tf", "static", *words)
    assert (done.returncode, "RBX9043" in done.stderr, reason in done.stderr) == (1, True, True), done.stderr


def test_an_angle_of_a_static_frame_needs_its_unit(robot: Robot) -> None:
    done = robot.do("tf", "static", "map", "laser", "--yaw", "-90")
    assert (done.returncode, "write '-90 deg' or '-90 rad'" in done.stderr) == (2, True)


def test_without_a_router_that_is_a_finding(robot: Robot) -> None:
    assert "RBX9020" in robot.do("topic", "ls", "--router", "tcp/127.0.0.1:1").stderr
    assert "RBX9020" in robot.do("service", "ls", "--router", "nonsense").stderr
    assert robot.told("topic", "ls", "--domain", "7") == []


def driving(robot: Robot, early: str = "") -> Keyboard:
    return Keyboard(robot, "drive", "--speed", "0.1 m/s", early=early, ready="ready: ")


def test_the_robot_moves_only_while_a_key_is_pressed(robot: Robot) -> None:
    with Guest(robot.place()) as guest:
        topic = find(guest.graph().topics, "/cmd_vel/teleop")
        assert topic is not None
        speeds: list[float] = []
        guest.listen(topic, lambda heard: speeds.append(decode(Twist, heard.arrival.payload).linear.x))
        keyboard = driving(robot, early="ww\x1b[A").until_ready()
        assert not guest.run(lambda: speeds != [], 0.2)
        keyboard.press("\x1b[A")
        assert guest.run(lambda: 0.0 in speeds, PATIENCE)
        assert not guest.run(lambda: speeds[-1] != 0.0 or speeds.count(0.0) > 1, 0.5)
        assert set(speeds[:-1]) == {0.1}
        keyboard.press("sq")
        assert keyboard.end() == 0
        assert guest.run(lambda: speeds[-2:] == [-0.1, 0.0], PATIENCE)


@pytest.mark.parametrize("number", [signal.SIGINT, *rare(signal.SIGTERM, signal.SIGHUP)])
def test_the_terminal_is_what_it_was_after_every_end(robot: Robot, number: signal.Signals) -> None:
    keyboard = driving(robot).until_ready()
    keyboard.process.send_signal(number)
    assert keyboard.end() == 0


@pytest.mark.parametrize("keys", ["wq", *rare("\x04", "w\n\x04")])
def test_an_end_that_was_typed_before_it_was_ready_counts(robot: Robot, keys: str) -> None:
    assert driving(robot, early=keys).end() == 0


def test_the_end_of_input_ends_driving(robot: Robot) -> None:
    keyboard = driving(robot).until_ready()
    keyboard.press("\x04")
    assert keyboard.end() == 0


def test_driving_needs_a_terminal(robot: Robot) -> None:
    done = robot.do("drive")
    assert (done.returncode, "RBX9027" in done.stderr) == (1, True)
