"""Two servos of protocol 2.0 behind a pseudo-terminal of the test, and a robot in real processes that drives them."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable
from pathlib import Path
from signal import Signals
from typing import Self

from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.processes import Process
from rbxcompose.testing import FakeLine, FakePort, FakeServo
from tests.commands import command
from tests.conftest import ROOT
from tests.forked import run_command

NAME = f"arm_with_faults_{os.getpid()}"
PATIENCE = 60.0  # [s]
LIMIT = '<limit lower="-2" upper="2" effort="1" velocity="2"/>'
BODY = f"""<robot name="arm">
  <link name="base"/><link name="upper"/><link name="lower"/>
  <joint name="lift_joint" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>{LIMIT}</joint>
  <joint name="flex_joint" type="revolute"><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/>{LIMIT}</joint>
</robot>
"""
ROBOT = f"""rbx: 1
kind: Robot
name: {NAME}
body: {{urdf: arm.urdf}}
bus: {{port: PORT}}
buses:
  servos: {{type: dynamixel, port: ./servos, rate: 50 Hz}}
actuators:
  lift: {{bus: servos, model: XL430-W250, id: 1}}
  flex: {{bus: servos, model: XL430-W250, id: 2}}
joints:
  lift_joint: {{actuator: lift, limits: {{acceleration: 20 rad/s^2}}}}
  flex_joint: {{actuator: flex, limits: {{acceleration: 20 rad/s^2}}}}
controllers:
  arm: {{type: joint_trajectory, joints: [lift_joint, flex_joint]}}
"""


class Arm:
    """The robot, up with `--real`; the servos stay when its processes die, as real ones do."""

    def __init__(self, folder: Path, safety: str = "{}") -> None:
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
        self._folder = folder
        path = folder / "servos"
        text = ROBOT.replace("PORT", str(port)).replace("./servos", str(path)) + f"safety: {safety}\n"
        (folder / "robot.yaml").write_text(text, encoding="utf-8")
        (folder / "arm.urdf").write_text(BODY, encoding="utf-8")
        (folder / "temporary").mkdir()
        self.environment = {
            **os.environ,
            "XDG_RUNTIME_DIR": str(folder),
            "TMPDIR": str(folder / "temporary"),
            "PYTHONPATH": str(ROOT),
            "NO_COLOR": "1",
        }
        self.state = RobotFolder(folder / "rbxcompose" / NAME)
        self.line = FakeLine([FakeServo("XL430-W250", id_) for id_ in (1, 2)], time.monotonic)
        self.port = FakePort(self.line, path)
        ran = run_command(("up", "robot.yaml", "--real", "-d"), self.environment, 60.0, folder)
        assert ran.returncode == 0, ran.stdout + ran.stderr

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.do("down", NAME)
        self.port.unplug()

    def do(self, *words: str) -> str:
        """Run a command to its end and return what it said."""
        ran = command(*words, environment=self.environment, folder=self._folder)
        return ran.stdout + ran.stderr

    def command(self, joint: str, position: float) -> None:
        """Move a joint."""
        self.do("topic", "pub", f"{joint}/command", "std_msgs/Float64", f"data: {position}")

    def moves(self, joint: str, position: float, condition: Callable[[], bool]) -> bool:
        """Move a joint until something holds; a loaded machine may lose so many replies that it stops on its way."""
        until = time.monotonic() + PATIENCE
        while not condition() and time.monotonic() < until:
            self.command(joint, position)
            self.wait_for(condition, 2.0)
        return condition()

    def process(self, name: str) -> Process | None:
        """Return one of the robot's processes, None if it is not there now."""
        state = self.state.read_state()
        assert state is not None
        return state.supervisor if name == "supervisor" else state.processes.get(name)

    def send(self, name: str, number: Signals) -> Process:
        """Send a signal to one of the robot's processes, which must be there."""
        found = self.process(name)
        assert found is not None
        found.send_signal(number)
        return found

    def torque(self) -> list[int]:
        """Return whether each servo has torque."""
        return [self.line[id_].get("torque_enable") for id_ in (1, 2)]

    def tick(self, id: int = 1) -> int:
        """Return where a servo is."""
        return self.line[id].get("present_position")

    @staticmethod
    def wait_for(condition: Callable[[], bool], patience: float = PATIENCE) -> bool:
        """Wait until something holds; return whether it did in time [s]."""
        until = time.monotonic() + patience
        while not condition() and time.monotonic() < until:
            time.sleep(0.02)
        return condition()
