"""Types of a robot's own, on a robot in real processes."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from mcap.reader import make_reader

from tests.cli.live_robot import PATIENCE, Robot

TEXT = """
rbx: 1
kind: Robot
name: gripper
bus: {port: 7894}
msgs: {own: msgs}
components:
  width: {type: threshold, topic: grasp, message: my_msgs/Grasp, field: width, warn_below: 0.1}
  watch: {type: topic_monitor, topic: fingers, message: my_msgs/Finger, rate: 1 Hz}
"""


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(base, TEXT)
    folder = base / "msgs/my_msgs/msg"
    folder.mkdir(parents=True)
    (folder / "Grasp.msg").write_text("float64 width\nFinger[] fingers\n")
    (folder / "Finger.msg").write_text('string name "thumb"\n')
    up = made.do("up", "-d", str(made.file))
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


def test_a_guest_publishes_shows_and_records_them(robot: Robot) -> None:
    file = robot.file.parent / "run.mcap"
    recording = subprocess.Popen(
        robot.command("record", "-o", str(file), "--for", "4s", "--topics", "grasp"),
        env=robot.environment,
        stdout=subprocess.DEVNULL,
    )
    with subprocess.Popen(
        robot.command("topic", "echo", "grasp", "-n", "1", "--json"),
        env=robot.environment,
        stdout=subprocess.PIPE,
        text=True,
    ) as echo:
        sent = robot.do(
            "topic", "pub", "grasp", "my_msgs/Grasp", "{width: 0.5, fingers: [{}]}", "--rate", "10Hz", "-n", "20"
        )
        assert sent.returncode == 0, sent.stderr
        assert json.loads(echo.communicate(timeout=PATIENCE)[0]) == {"width": 0.5, "fingers": [{"name": "thumb"}]}
    assert recording.wait(PATIENCE) == 0
    with file.open("rb") as stream:
        schemas = [(schema.name, schema.data) for schema, _, _ in make_reader(stream).iter_messages() if schema]
    assert schemas
    assert schemas[0][0] == "my_msgs/msg/Grasp"
    assert b'MSG: my_msgs/Finger\nstring name "thumb"' in schemas[0][1]


def test_a_component_reads_them(robot: Robot) -> None:
    robot.do("topic", "pub", "grasp", "my_msgs/Grasp", "{width: 0.05}", "--rate", "10Hz", "-n", "20")
    assert "width" in robot.do("diag").stdout


def test_a_misspelt_type_is_told_with_those_of_the_robot(robot: Robot) -> None:
    done = robot.do("topic", "pub", "grasp", "my_msgs/Grsp")
    assert "did you mean 'my_msgs/msg/Grasp'?" in done.stderr
