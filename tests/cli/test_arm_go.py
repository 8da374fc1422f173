"""`rbxcompose arm go` on a robot in real processes."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.live_robot import Robot

MANIFEST = """rbx: 1
kind: Robot
name: reacher
bus: {port: 7896}
buses: {servos: {type: dynamixel}}
include:
  arm: {part: "rbx:parts/servo_arm.yaml", with: {bus: servos}}
"""
ELBOW = "arm_elbow_flex_joint"
pytestmark = pytest.mark.timeout(120)  # real processes, which load the libraries of arms


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(base, MANIFEST)
    up = made.do("up", "-d", str(made.file))
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


def test_joints_go_to_their_positions_and_the_others_stay(robot: Robot) -> None:
    before = positions(robot)
    done = robot.do("arm", "go", "arm", f"{{{ELBOW}: 0.3 rad}}")
    assert done.returncode == 0, done.stderr
    after = positions(robot)
    assert after.pop(ELBOW) == pytest.approx(0.3, abs=0.02)
    assert after == pytest.approx({name: at for name, at in before.items() if name != ELBOW}, abs=0.02)
    keep = f"{{joints: [{{name: {ELBOW}, lower: -2 rad, upper: 2 rad}}]}}"
    kept = robot.do("arm", "go", "arm", f"{{{ELBOW}: 0 deg}}", "--keep", keep)
    assert (kept.returncode, kept.stderr) == (0, "")


@pytest.mark.parametrize(
    ("words", "told", "code"),
    [
        ((f"{{{ELBOW}: 3 cm}}",), f"'{ELBOW}' turns, and this is a length", 1),
        (("{arm_elbow_joint: 1 rad}",), f"no joint of this arm; did you mean ''{ELBOW}''?", 1),
        (("{points: [{x: 1 cm}]}", "--keep", "{roll: 1 deg}"), "--keep is not for a way", 2),
        (("resting", "--router", "tcp/127.0.0.1:1"), "router", 1),
    ],
)
def test_what_no_joint_can_do_is_refused_before_anything_moves(
    robot: Robot, words: tuple[str, ...], told: str, code: int
) -> None:
    done = robot.do("arm", "go", "arm", *words)
    assert (done.returncode, told in done.stdout + done.stderr) == (code, True), done.stderr
    assert "planning" not in done.stdout


def positions(robot: Robot) -> dict[str, float]:
    state = robot.told("topic", "echo", "/joint_states", "--once")
    message = state.get("message", state)
    return dict(zip(message["name"], message["position"], strict=True))
