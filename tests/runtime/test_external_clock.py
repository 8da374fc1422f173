"""A robot whose time is told on `/clock`: the driver with a fed clock, what is held, and one run in real processes."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from rbxcompose.base.clock import NANOSECONDS, PATIENCE, ExternalClock, SteppedClock, Turn
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.commands.main import main as run_command
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.rosgraph_msgs import Clock
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Empty
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.channel import Channel
from rbxcompose.runtime.folder import RunOptions
from rbxcompose.runtime.process_group.connection import CallbackInbox, ExternalDriver
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from tests.bus.conftest import Network, network
from tests.forked import RBXCOMPOSE, Forked
from tests.runtime.stage import ENDPOINT, Stage
from tests.runtime.stage import robot as conducted
from tests.runtime.test_driver import Driven

__all__ = ["network"]

ROOT = Path(__file__).parents[2]
FORWARD, REST = Twist(linear=Vector3(x=0.3)), Twist()


class Fed:
    """A driver that is fed outside times, one in each round, each at a real time of its own."""

    def __init__(self, told: list[tuple[float, float]]) -> None:
        self.scheduler, self.clock, self.real = Scheduler(), ExternalClock(), SteppedClock()
        self.turns: list[tuple[float, Turn]] = []
        self._told = told
        self._inbox = CallbackInbox()
        ends = socket.socketpair()
        self._channels = [Channel(end) for end in ends]
        driven = Driven(self._is_over)
        self._driver = ExternalDriver(self.scheduler, self.clock, self._inbox, self._channels[0], driven, self._note)
        self._driver.follow(self.real)

    def run(self) -> None:
        """Feed everything and let the driver end."""
        try:
            self._driver.run()
        finally:
            self._inbox.close()
            for channel in self._channels:
                channel.close()

    def _note(self, turn: Turn) -> None:
        self.turns.append((self.real.now(), turn))

    def _is_over(self) -> bool:
        if self.clock.now() < self.clock.limit:
            return False
        if not self._told:
            return True
        real, outside = self._told.pop(0)
        self.real.advance_to(real)
        self._inbox.put("", lambda: self._driver.receive(round(outside * NANOSECONDS)))
        return False


def test_a_step_runs_for_each_instant_at_which_it_was_due_however_coarse_the_clock_is() -> None:
    fed = Fed([(0.0, 100.0), (0.1, 100.5), (0.2, 101.0)])
    ran: list[float] = []
    fed.scheduler.every(0.1, "x", lambda dt: ran.append(fed.clock.now()))
    fed.run()
    assert ran == pytest.approx([0.1 * number for number in range(1, 11)])


def test_the_driver_tells_when_time_stands_goes_and_jumps() -> None:
    quiet = PATIENCE + 0.2
    fed = Fed([(0.0, 5.0), (0.1, 5.1), (quiet, 5.1), (quiet + 0.1, 5.2), (quiet + 0.2, 1.0)])
    fed.run()
    assert fed.turns == [(0.1, Turn.GOES), (quiet, Turn.STANDS), (quiet + 0.1, Turn.GOES), (quiet + 0.2, Turn.JUMPED)]


@pytest.fixture
def robot() -> Bench:
    inputs = {"teleop": {"priority": 100, "timeout": "0.5 s"}}
    locks = {"door": {"priority": 200, "timeout": "0.5 s"}}
    return Bench(
        instance("base", "diff_drive_sim"),
        instance("cmd_vel", "mux", {"output": "cmd_vel", "inputs": inputs, "locks": locks}),
    )


def test_while_time_stands_still_only_rest_is_commanded(robot: Bench) -> None:
    robot.publish("/cmd_vel/door", Empty())
    robot.publish("/cmd_vel/teleop", FORWARD)
    out = robot.collect("/cmd_vel", Twist)
    robot.host.hold()
    robot.publish("/cmd_vel/door", Empty())
    robot.publish("/cmd_vel/teleop", FORWARD)
    assert out == [REST]


def test_when_time_goes_again_each_deadline_counts_again(robot: Bench) -> None:
    robot.publish("/cmd_vel/door", Empty())
    robot.publish("/cmd_vel/teleop", FORWARD)
    robot.advance(0.3)
    robot.host.hold()
    robot.host.go_on()
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/teleop", FORWARD)  # the door has not been heard of since
    robot.advance(0.4)
    assert (out, robot.host.is_at_rest) == ([], True)
    robot.publish("/cmd_vel/door", Empty())
    robot.publish("/cmd_vel/teleop", FORWARD)
    robot.advance(0.1)
    assert (out, robot.host.is_at_rest) == ([FORWARD], False)


def test_time_that_goes_again_opens_no_stop(robot: Bench) -> None:
    robot.host.stop()
    robot.host.hold()
    robot.host.go_on()
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/door", Empty())
    robot.publish("/cmd_vel/teleop", FORWARD)
    assert out == []


def test_what_must_come_to_rest_after_a_stop_still_must_after_a_standstill(robot: Bench) -> None:
    for _ in range(2):
        robot.publish("/cmd_vel/door", Empty())
        robot.publish("/cmd_vel/teleop", FORWARD)
        robot.host.stop()
    robot.host.release()
    robot.host.hold()
    robot.host.go_on()
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/door", Empty())
    robot.publish("/cmd_vel/teleop", FORWARD)
    assert out == []


def test_a_component_that_is_restarted_meanwhile_is_held_too(robot: Bench) -> None:
    robot.host.hold()
    robot.host.failed("cmd_vel", RuntimeError("planted"))
    robot.advance(1.0)
    out = robot.collect("/cmd_vel", Twist)
    robot.publish("/cmd_vel/door", Empty())
    robot.publish("/cmd_vel/teleop", FORWARD)
    assert out == []


def following(options: RunOptions) -> Stage:
    """Return a robot that is up and follows `/clock`, at robot time 4 s."""
    plan = conducted()
    stage = Stage(replace(plan, bus=replace(plan.bus, clock="external")), options)
    stage.configure("router", *plan.groups)
    stage.activate()
    stage.scheduler.advance(0.9)
    stage.speak("robot", say.Alive(4.0))
    return stage


def test_a_process_that_is_forked_again_is_told_the_robot_time_of_the_others() -> None:
    stage = following(RunOptions())
    stage.exit("robot")
    stage.scheduler.advance(1.1)
    assert stage.sent[-1] == ("robot", say.Configure(ENDPOINT, 4.0))


def test_the_duration_of_a_run_is_counted_in_the_time_from_outside() -> None:
    stage = following(RunOptions(duration=5.0))
    for process in stage.plan.groups:
        stage.speak(process, say.Alive(4.9))
    assert not stage.conductor.is_going_down
    stage.speak("robot", say.Alive(5.1))
    assert (stage.conductor.is_going_down, stage.conductor.reason) == (True, "the time is up")


def test_a_stepped_run_of_it_is_wrong_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(MANIFEST.format(port=7447), encoding="utf-8")
    assert run_command(["up", str(file), "--rate", "max", "--for", "0.6s"]) == 2
    assert "so --rate cannot be given with it" in capsys.readouterr().err


MANIFEST = """
rbx: 1
kind: Robot
name: follower
bus: {{clock: external, router: "tcp/127.0.0.1:{port}"}}
components:
  base: {{type: diff_drive_sim}}
muxes:
  cmd_vel:
    inputs:
      teleop: {{priority: 100, timeout: 0.5 s}}
"""


class Simulator:
    """Publishes `/clock` in steps of 20 ms, as fast as real time."""

    STEP = 0.02  # [s]

    def __init__(self, publish: Callable[[Clock], None]) -> None:
        self.time = 1000.0
        self._publish, self._last = publish, time.monotonic()

    def run(self) -> bool:
        """Publish the next step if it is due; return whether it is."""
        if time.monotonic() - self._last < self.STEP:
            return False
        self._last = time.monotonic()
        self.time += self.STEP
        self._publish(Clock(clock=to_time(round(self.time * NANOSECONDS))))
        return True


@pytest.fixture
def follower(network: Network) -> Iterator[subprocess.Popen[str]]:
    """A robot that follows `/clock`, in processes of its own."""
    folder = Path(tempfile.mkdtemp(prefix="rbx"))  # short enough for a socket's name
    file = folder / "robot.yaml"
    file.write_text(MANIFEST.format(port=network.port), encoding="utf-8")
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), "NO_COLOR": "1"}
    robot = Forked(
        [*RBXCOMPOSE, "up", str(file), "--for", "1.5s"],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=ROOT,
    )
    yield robot
    robot.terminate()
    robot.wait()
    shutil.rmtree(folder)


def test_a_real_robot_follows_stands_goes_on_jumps_and_bears_a_dispute(
    network: Network, follower: subprocess.Popen[str]
) -> None:
    process = network.process()
    simulator = Simulator(process.bus.publisher("simulator", "/clock", Clock, Qos.COMMAND))
    steer = process.bus.publisher("simulator", "cmd_vel/teleop", Twist, Qos.COMMAND)
    commands: list[Twist] = []
    odometry: list[Odometry] = []
    levels: list[int] = []
    process.bus.subscribe("simulator", "cmd_vel", Twist, Qos.COMMAND, commands.append)
    process.bus.subscribe("simulator", "odom", Odometry, Qos.STATE, odometry.append)

    def take(message: DiagnosticArray) -> None:
        levels.extend(status.level for status in message.status if status.name == "bus.clock")

    process.bus.subscribe("simulator", "/diagnostics", DiagnosticArray, Qos.STATE, take)

    def drive() -> None:
        if simulator.run():
            steer(FORWARD)

    def until(holds: Callable[[], object], meanwhile: Callable[[], object]) -> None:
        def look() -> object:
            meanwhile()
            return holds()

        network.until(look, within=10.0)

    network.until(lambda: levels and levels[-1] == 3, within=10.0)  # nobody has told any time yet
    until(lambda: odometry and odometry[-1].twist.twist.linear.x > 0.05, drive)
    assert odometry[-1].header.stamp.sec in (1000, 1001)
    until(lambda: levels[-1] == 3 and commands[-1] == REST, lambda: steer(FORWARD))
    seen = len(odometry)
    until(lambda: len(odometry) > seen, simulator.run)
    simulator.time = 5.0
    until(lambda: odometry[-1].header.stamp.sec == 5, simulator.run)
    other = Simulator(process.bus.publisher("another simulator", "/clock", Clock, Qos.COMMAND))

    def dispute() -> None:
        drive()
        other.run()

    until(lambda: levels[-1] == 2 and commands[-1] == REST, dispute)
    until(lambda: follower.poll() is not None, simulator.run)
    output, _ = follower.communicate()
    assert follower.returncode == 0, output
    told = iter(output.splitlines())
    for words in ("stands still:", "runs:", "stands still:", "runs:", "has jumped", "jumps back", "runs:"):
        assert any(f"/clock {words}" in line for line in told), output
    assert output.count("/clock") < 12, output  # not a line for each jump
