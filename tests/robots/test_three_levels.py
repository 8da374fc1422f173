"""Arm and head of the book's robot do what it commands, on each level of simulated servos; real ones get that plan."""

from __future__ import annotations

import json
import os
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.commands import command
from tests.conftest import ROOT
from tests.forked import run_command
from tests.soak import rare

PAN, LIFT = "head_pan_joint", "right_arm_shoulder_lift_joint"
LIFT_ID = 4
TICK = 0.00512  # [rad] of an AX-12
TRIES = 5  # of a command


class Stage(ABC):
    """The robot, as somebody at its side commands it."""

    @abstractmethod
    def command(self, joint: str, position: float) -> None:
        """Move a joint."""

    @abstractmethod
    def enable(self, joint: str, enabled: bool) -> None:
        """Enable or disable a joint."""

    @abstractmethod
    def relax(self, joint: str) -> None:
        """Let go of a joint."""

    @abstractmethod
    def wait(self, seconds: float) -> None:
        """Let time pass [s]."""

    @abstractmethod
    def at(self, joint: str) -> float:
        """Return where a joint is [rad]."""

    def moves(self, joint: str, position: float) -> bool:
        """Move a joint; return whether it arrives. On a loaded machine so many replies may be lost that it stops."""
        for _ in range(TRIES):
            self.command(joint, position)
            for _ in range(16):
                self.wait(0.25)
                if abs(self.at(joint) - position) < TICK:
                    return True
        return False


class Stepped(Stage):
    """In virtual time, with servos as memory."""

    def __init__(self, level: str) -> None:
        plan = planned("pi_robot", f"buses.servos.sim={level}")
        [driver] = [instance for instance in plan.instances if instance.type == "servo_bus"]
        self.robot = Bench(driver, start=False)
        self.states: dict[str, float] = {}
        self.robot.bus.subscribe("me", "/joint_states", JointState, Qos.STATE, self._moved)
        self.senders = {
            name: self.robot.bus.publisher("me", f"/{name}/command", Float64, Qos.COMMAND) for name in (PAN, LIFT)
        }
        self.wait(0.2)

    def _moved(self, message: JointState) -> None:
        self.states = dict(zip(message.name, map(float, message.position), strict=True))

    def command(self, joint: str, position: float) -> None:
        self.senders[joint](Float64(data=position))

    def enable(self, joint: str, enabled: bool) -> None:
        self._ask(f"/{joint}/enable", SetBool, SetBool.Request(data=enabled))

    def relax(self, joint: str) -> None:
        self._ask(f"/{joint}/relax", Trigger, Trigger.Request())

    def _ask(self, name: str, service: Any, request: Any) -> None:
        self.robot.bus.client("me", name, service)(request, lambda reply: None)
        self.wait(0.1)

    def wait(self, seconds: float) -> None:
        self.robot.advance(seconds)

    def at(self, joint: str) -> float:
        return self.states[joint]

    @property
    def lift_servo(self) -> Any:
        """Return the simulated servo that lifts the arm."""
        driver: Any = self.robot.component("servos")
        return driver.cycle.bus.line[LIFT_ID]


class Spoken(Stage):
    """In real processes, with servos that speak bytes on a pseudo-terminal."""

    def __init__(self, folder: Path) -> None:
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
        (folder / "temporary").mkdir()
        own = {"XDG_RUNTIME_DIR": str(folder), "TMPDIR": str(folder / "temporary"), "PYTHONPATH": str(ROOT)}
        self.environment = {**os.environ, **own, "NO_COLOR": "1"}
        up = ("up", "-d", "robots/pi_robot", "--set", "buses.servos.sim=pty", "--set", f"bus.port={port}")
        self.told = run_command(up, self.environment, 60.0).stdout

    def do(self, *words: str) -> str:
        """Run a command to its end and return what it said."""
        ran = command(*words, environment=self.environment, folder=ROOT)
        return ran.stdout + ran.stderr

    def command(self, joint: str, position: float) -> None:
        assert "1 sent" in self.do("topic", "pub", f"{joint}/command", "std_msgs/Float64", f"data: {position}")

    def enable(self, joint: str, enabled: bool) -> None:
        assert "success: true" in self.do("service", "call", f"{joint}/enable", f"data: {str(enabled).lower()}")

    def relax(self, joint: str) -> None:
        assert "success: true" in self.do("service", "call", f"{joint}/relax")

    def wait(self, seconds: float) -> None:
        time.sleep(seconds)

    def at(self, joint: str) -> float:
        told = json.loads(self.do("topic", "echo", "joint_states", "--count", "1", "--json").splitlines()[0])
        message = told.get("message", told)
        return float(dict(zip(message["name"], message["position"], strict=True))[joint])


@pytest.fixture
def spoken(tmp_path: Path) -> Iterator[Spoken]:
    stage = Spoken(tmp_path)
    try:
        yield stage
    finally:
        stage.do("down", "pi_robot")


def planned(name: str, *sets: str, **options: Any) -> Plan:
    out = compile_robot(str(ROOT / "robots" / name), sets=sets, environment={}, **options)
    assert out.plan, list(out.report)
    return out.plan


def follow_the_book(stage: Stage) -> None:
    """Command what its readers are told to."""
    assert stage.moves(PAN, 1.0)
    assert stage.moves(LIFT, -2.0)
    stage.enable(PAN, False)
    stage.command(PAN, -1.0)
    stage.wait(2.0)
    assert stage.at(PAN) == pytest.approx(1.0, abs=TICK)
    stage.enable(PAN, True)
    assert stage.moves(PAN, -1.0)
    stage.relax(LIFT)


@pytest.mark.parametrize("level", ["servo", *rare("ideal")])
def test_simulated_joints_do_what_the_book_commands_and_start_again_where_they_were_turned(level: str) -> None:
    stage = Stepped(level)
    follow_the_book(stage)
    assert stage.lift_servo.get("torque_enable") == 0
    stage.lift_servo.move_to(400)  # by hand
    stage.wait(1.0)
    turned = (400 - 512) * TICK
    assert stage.at(LIFT) == pytest.approx(turned, abs=2 * TICK)
    stage.command(LIFT, 0.0)
    stage.wait(0.1)
    assert stage.at(LIFT) == pytest.approx(turned, abs=0.1)
    assert stage.moves(LIFT, 0.0)


@pytest.mark.timeout(120)
def test_servos_that_speak_bytes_do_what_the_book_commands(spoken: Spoken) -> None:
    assert "pi_robot is up" in spoken.told
    follow_the_book(spoken)
    assert spoken.at(LIFT) == pytest.approx(-2.0, abs=2 * TICK)
    assert spoken.moves(LIFT, 0.0)


ON_A_TABLE = """rbx: 1
kind: Overlay
name: table
include:
  base: !remove
  teleop: !remove
  torso:
    attach: !remove
diagnostics:
  analyzers:
    motion:
      match: !replace [servos]
"""
OF_THE_TWIN = {"twin", "faults", "noise"}


@pytest.mark.parametrize("name", ["head_only", *rare("pi_robot")])
def test_real_servos_get_the_plan_of_simulated_ones(name: str, tmp_path: Path) -> None:
    overlay = tmp_path / "table.yaml"
    overlay.write_text(ON_A_TABLE, encoding="utf-8")
    options: dict[str, Any] = {}
    if name == "pi_robot":  # its wheels have no real driver
        options = {"overlays": [str(overlay)], "profiles": ["telescoping"]}
    real, simulated = (planned(name, real=is_real, **options) for is_real in (True, False))
    assert [one.name for one in real.instances] == [one.name for one in simulated.instances]
    assert real.bus == simulated.bus
    for instance, twin in zip(real.instances, simulated.instances, strict=True):
        assert (instance.type, instance.process, instance.wires) == (twin.type, twin.process, twin.wires)
        own, other = instance.config.model_dump(), twin.config.model_dump()
        differing = {key for key in own if own[key] != other[key]}
        assert differing <= OF_THE_TWIN
        assert ("twin" in differing) == (instance.type == "servo_bus")
