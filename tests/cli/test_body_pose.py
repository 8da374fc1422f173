"""`rbxcompose body pose` on a robot in real processes: by options, and by keys at a terminal."""

from __future__ import annotations

import math
import shutil
import signal
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from rbxcompose.bus.graph import find
from rbxcompose.commands.guest import Guest
from rbxcompose.msgs.cdr import decode
from rbxcompose.msgs.sensor_msgs import JointState
from tests.cli.live_robot import PATIENCE, Keyboard, Robot

MANIFEST = """rbx: 1
kind: Robot
name: posed
bus: {port: 7895}
body: {urdf: posed.urdf}
"""
URDF = """<robot name="posed"><link name="base"/><link name="head"/><link name="arm"/>
<joint name="pan" type="revolute"><parent link="base"/><child link="head"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="lift" type="prismatic"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="0" upper="0.5" effort="1" velocity="1"/></joint></robot>"""
Heard = list[dict[str, float]]


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    (base / "posed.urdf").write_text(URDF)
    made = Robot(base, MANIFEST)
    up = made.do("up", "-d", str(made.file))
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


@pytest.fixture
def guest(robot: Robot) -> Iterator[Guest]:
    with Guest(robot.place()) as one:
        yield one


@pytest.fixture
def heard(guest: Guest) -> Heard:
    """The positions that are published, by joint, in their order."""
    found: Heard = []
    topic = find(guest.graph().topics, "/joint_states")
    assert topic is not None

    def read(payload: bytes) -> None:
        message = decode(JointState, payload)
        assert message.header.stamp.sec > 0
        found.append(dict(zip(message.name, map(float, message.position), strict=True)))

    guest.listen(topic, lambda message: read(message.arrival.payload))
    return found


def test_positions_are_published_and_move_the_frames(robot: Robot, guest: Guest, heard: Heard) -> None:
    done = robot.do("body", "pose", "posed", "--joint", "pan=30 deg", "--joint", "lift=20 cm")
    assert (done.returncode, done.stdout) == (0, "/joint_states: 1 sent\n"), done.stderr
    assert guest.run(lambda: bool(heard), PATIENCE)
    assert heard[0] == pytest.approx({"pan": math.radians(30), "lift": 0.2})
    frames = {entry["frame"]: entry for entry in robot.told("tf", "tree")}
    assert (frames["head"]["yaw"], frames["arm"]["translation"]) == (30.0, [0.0, 0.0, 0.2])


def test_positions_are_published_again_for_some_time(robot: Robot, guest: Guest, heard: Heard) -> None:
    done = robot.do("body", "pose", "--joint", "pan=0.1", "--duration", "0.55s")
    assert done.returncode == 0, done.stderr
    sent = int(done.stdout.split()[1])
    assert 2 <= sent <= 7
    assert guest.run(lambda: len(heard) == sent, PATIENCE)


@pytest.mark.parametrize(
    ("words", "code", "why"),
    [
        (["--joint", "pann=1"], 1, "did you mean 'pan'?"),
        (["--joint", "pan=2"], 2, "must be between -57.3 deg and 57.3 deg"),
        (["--duration", "1s"], 2, "--duration is for the positions of --joint"),
        (["--joint", "pan=1", "--topic", "other"], 1, "nothing publishes a URDF on 'other'"),
        (["--joint", "pan=1", "--domain", "7"], 1, "this robot has no body"),
    ],
)
def test_what_is_not_there_or_not_possible_is_told(robot: Robot, words: list[str], code: int, why: str) -> None:
    done = robot.do("body", "pose", *words)
    assert (done.returncode, why in done.stderr) == (code, True), done.stderr


def sliding(robot: Robot, early: str = "") -> Keyboard:
    return Keyboard(robot, "body", "pose", early=early, ready="R: so with all joints")


def test_keys_move_joints(robot: Robot, guest: Guest, heard: Heard) -> None:
    robot.do("body", "pose", "--joint", "pan=0.1", "--joint", "lift=10 cm")
    assert guest.run(lambda: bool(heard), PATIENCE)
    heard.clear()
    keyboard = sliding(robot, early="\x1b[C")
    assert "> pan" in keyboard.until(keyboard.ready)
    assert guest.run(lambda: len(heard) > 1, PATIENCE)
    assert heard[0] == heard[1] == pytest.approx({"pan": 0.1, "lift": 0.1})  # nothing moves yet
    keyboard.press("\x1b[1;2C\x1b[B\x1b[C")
    assert guest.run(lambda: heard[-1] == pytest.approx({"pan": 0.1 + math.radians(10), "lift": 0.11}), PATIENCE)
    assert "> lift" in keyboard.until("11 cm")
    keyboard.press("Zq")
    assert keyboard.end() == 0
    assert guest.run(lambda: heard[-1] == {"pan": 0.0, "lift": 0.0}, PATIENCE)


def test_the_terminal_is_what_it_was_after_an_interrupt(robot: Robot) -> None:
    keyboard = sliding(robot).until_ready()
    keyboard.process.send_signal(signal.SIGINT)
    assert keyboard.end() == 0


def test_an_end_that_was_typed_before_it_was_ready_counts(robot: Robot) -> None:
    assert sliding(robot, early="\x1b[Cq").end() == 0


def test_sliders_need_a_terminal(robot: Robot) -> None:
    done = robot.do("body", "pose")
    assert (done.returncode, "RBX9027" in done.stderr) == (1, True)
