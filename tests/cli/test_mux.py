"""Who may command, told and decided by commands, on a robot in real processes."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.live_robot import Robot
from tests.loops import for_all

TEXT = """rbx: 1
kind: Robot
name: switched
components:
  base: {type: diff_drive_sim}
muxes:
  cmd_vel:
    inputs:
      teleop: {priority: 100, timeout: 0.5 s}
      planner: {priority: 10, timeout: 0.5 s}
    locks:
      pause: {topic: pause, priority: 50}
  head_vel:
    mode: select
    inputs: {joystick: {}, camera: {}}
"""


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(base, TEXT)
    up = made.do("up", "-d", str(made.file), "--set", "bus.port=7891")
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


def test_muxes_are_listed_and_each_tells_who_holds_it(robot: Robot) -> None:
    assert [(entry["name"], entry["mode"], entry["holder"]) for entry in robot.told("mux")] == [
        ("cmd_vel", "priority", None),
        ("head_vel", "select", "joystick"),
    ]
    shown = robot.do("mux", "why", "cmd_vel").stdout.splitlines()
    assert shown[0] == "cmd_vel: no input"
    assert [line.split() for line in shown[2:]] == [
        ["teleop", "100", "silent", "never"],
        ["planner", "10", "silent", "never"],
        ["lock", "pause:", "open"],
    ]


def test_what_is_locked_by_hand_is_seen_in_ps_until_it_is_unlocked(robot: Robot) -> None:
    assert robot.told("mux", "lock", "cmd_vel", "planner")["answer"].startswith("locked by hand")
    assert "cmd_vel: locked by hand: planner" in robot.do("ps").stdout
    assert "planner  10        locked  never       by hand" in robot.do("mux", "why", "cmd_vel").stdout
    assert robot.told("mux", "unlock", "cmd_vel")["answer"] == "unlocked: planner"
    assert "locked" not in robot.do("ps").stdout


def test_inputs_are_added_selected_and_deleted(robot: Robot) -> None:
    robot.told("mux", "add", "head_vel", "wheel", "--topic", "/wheel/head")
    robot.told("mux", "select", "head_vel", "wheel")
    assert robot.told("mux", "why", "head_vel")["holder"] == "wheel"
    assert robot.told("topic", "echo", "/head_vel/active", "--once")["data"] == "wheel"
    assert robot.do("mux", "delete", "head_vel", "wheel").returncode == 1
    robot.told("mux", "select", "head_vel", "__none")
    robot.told("mux", "delete", "head_vel", "wheel")
    changes = robot.do("mux", "watch", "head_vel", "-n", "1").stdout
    assert changes.endswith("no input\n")


@for_all(
    "words, told",
    [
        (("watch",), "several muxes, so name one; muxes: cmd_vel, head_vel"),
        (("why", "cmd_vl"), "there is no mux 'cmd_vl'; did you mean 'cmd_vel'?"),
        (("why", "cmd_vel", "teleop"), "there is no mux 'teleop'"),
        (("select", "head_vel", "cammera"), "'head_vel' has no input 'cammera'; did you mean 'camera'?"),
        (("select", "head_vel"), "name one input of 'head_vel'"),
        (("select", "cmd_vel", "teleop"), "its mode is 'priority'"),
        (("add", "cmd_vel", "bumper"), "an input needs a priority and a timeout"),
        (("add", "cmd_vel", "my-bumper", "--priority", "50", "--timeout", "0.2s"), "'my-bumper' cannot be the name"),
        (("unlock", "head_vel"), "nothing is locked by hand"),
    ],
)
def test_a_mistake_is_told_with_what_was_probably_meant(robot: Robot, words: tuple[str, ...], told: str) -> None:
    done = robot.do("mux", *words)
    assert (done.returncode, told in done.stderr) == (1, True), done.stderr
