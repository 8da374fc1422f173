"""Types of a robot's own, on a robot in real processes."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import monotonic
from typing import Any

import pytest
from mcap.reader import make_reader
from websockets.sync.client import connect

from tests.cli.live_robot import PATIENCE, Robot
from tests.conftest import ROOT
from tests.forked import Forked

TEXT = """
rbx: 1
kind: Robot
name: gripper
bus: {port: 7894}
console: {port: 8194}
msgs: {own: msgs}
components:
  gripper: {type: toy_own_gripper}
  width: {type: threshold, topic: grasp, message: my_msgs/Grasp, field: width, warn_below: 0.1}
  watch: {type: topic_monitor, topic: fingers, message: my_msgs/Finger, rate: 1 Hz}
"""

PLUGIN = '''
from rbxcompose.msgs.my_msgs import Grasp, Open
from rbxcompose.sdk import Component, Config, Out, Serves, component


class GripperConfig(Config):
    """Nothing."""


@component("toy_own_gripper")
class Gripper(Component[GripperConfig]):
    """Opens.

    Example:
        gripper: {type: toy_own_gripper}
    """

    opened = Out(Grasp, "opened")
    open = Serves(Open, "open")

    def on_open(self, request: Open.Request) -> Open.Response:
        """Open it."""
        self.opened(request.grasp)
        return Open.Response(ok=request.grasp.width > 0.1)
'''
FILES = {
    "msgs/my_msgs/msg/Grasp.msg": "float64 width\nFinger[] fingers\n",
    "msgs/my_msgs/msg/Finger.msg": 'string name "thumb"\n',
    "msgs/my_msgs/srv/Open.srv": "Grasp grasp\n---\nbool ok\n",
    "lib/toy_own_gripper.py": PLUGIN,
    "lib/toy_own_gripper-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: toy-own-gripper\nVersion: 1.0\n",
    "lib/toy_own_gripper-1.0.dist-info/entry_points.txt": "[rbxcompose.plugins]\n"
    "component.toy_own_gripper = toy_own_gripper\n",
}


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(base, TEXT)
    made.environment["PYTHONPATH"] = f"{base}/lib:{ROOT}"
    for name, text in FILES.items():
        (base / name).parent.mkdir(parents=True, exist_ok=True)
        (base / name).write_text(text)
    up = made.do("up", "-d", str(made.file))
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


def test_a_guest_publishes_shows_and_records_them(robot: Robot) -> None:
    file = robot.file.parent / "run.mcap"
    recording = Forked(
        robot.command("record", "-o", str(file), "--for", "4s", "--topics", "grasp"),
        env=robot.environment,
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
    )
    with Forked(
        robot.command("topic", "echo", "grasp", "-n", "1", "--json"),
        env=robot.environment,
        cwd=ROOT,
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


def test_a_service_of_an_own_type_answers_a_guest(robot: Robot) -> None:
    done = robot.do("service", "call", "open", "{grasp: {width: 0.5}}")
    assert (done.returncode, done.stdout.strip()) == (0, "{ok: true}"), done.stderr


def test_the_gateway_knows_them(robot: Robot) -> None:
    with connect("ws://127.0.0.1:8194/rosbridge") as socket:
        socket.send(json.dumps({"op": "subscribe", "topic": "/opened", "type": "my_msgs/Grasp"}))
        heard: list[dict[str, Any]] = []
        deadline = monotonic() + PATIENCE
        while not {"publish", "service_response"} <= {each["op"] for each in heard} and monotonic() < deadline:
            socket.send(json.dumps({"op": "call_service", "service": "/open", "args": {"grasp": {"width": 2}}}))
            heard.append(json.loads(socket.recv(PATIENCE)))
    assert {"op": "publish", "topic": "/opened", "msg": {"width": 2.0, "fingers": []}} in heard
    assert any(each.get("values") == {"ok": True} for each in heard)


def test_a_misspelt_type_is_told_with_those_of_the_robot(robot: Robot) -> None:
    done = robot.do("topic", "pub", "grasp", "my_msgs/Grsp")
    assert "did you mean 'my_msgs/msg/Grasp'?" in done.stderr
