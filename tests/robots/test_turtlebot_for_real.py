"""The patrol robot in real processes on a real bus: a stop, and the death of the process that drives it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rbxcompose.bus.bus import Bus
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.clock import MonotonicClock
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.qos import Qos
from rbxcompose.runtime.processes import titled
from rbxcompose.scheduler import Scheduler

ROOT = Path(__file__).parents[2]
PATIENCE = 30.0  # [s]
NAME = "turtlebot_for_real"
ROBOT = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8").replace("name: turtlebot", f"name: {NAME}")
FASTER = ["--set", "args.speed=0.5 m/s", "--set", "missions.patrol.with.rounds=1"]


class Watcher:
    """Hears the odometry of a robot from outside, as any other participant of the bus would."""

    def __init__(self, endpoint: str) -> None:
        self.speeds: deque[float] = deque(maxlen=1)
        self._woken: deque[tuple[str, Callable[[], None]]] = deque()
        self._has_news = threading.Event()
        self._scheduler, self._clock = Scheduler(), MonotonicClock()
        transport = ZenohTransport(open_peer(endpoint), self._wake)
        self._bus = Bus(self._scheduler, self._clock, transport=transport, log=lambda owner, text: None)
        self._bus.subscribe("watcher", "odom", Odometry, Qos.STATE, self._take)

    def wait_until(self, holds: Callable[[float], bool]) -> None:
        """Wait until the speed of the base [m/s] is as wanted."""
        deadline = time.monotonic() + PATIENCE
        while not (self.speeds and holds(self.speeds[-1])):
            assert time.monotonic() < deadline, f"the speed stayed at {list(self.speeds)}"
            self.listen()

    def listen(self) -> None:
        """Take what has come."""
        self._has_news.wait(0.05)
        self._has_news.clear()
        while self._woken:
            self._scheduler.post(*self._woken.popleft())
        self._scheduler.advance(self._clock.now())

    def close(self) -> None:
        self._bus.close()

    def _wake(self, owner: str, callback: Callable[[], None]) -> None:
        self._woken.append((owner, callback))
        self._has_news.set()

    def _take(self, message: Odometry) -> None:
        self.speeds.append(message.twist.twist.linear.x)


class Patrol:
    """The robot, up in the foreground of a process."""

    def __init__(self, folder: Path, runtime: Path) -> None:
        (folder / "robots/turtlebot").mkdir(parents=True)
        (folder / "missions").mkdir()
        (folder / "robots/turtlebot/robot.yaml").write_text(ROBOT, encoding="utf-8")
        (folder / "missions/patrol.yaml").write_bytes((ROOT / "missions/patrol.yaml").read_bytes())
        self.folder = folder
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(runtime), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
        self.process = self.start("up", "robots/turtlebot", *FASTER)

    def start(self, *words: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "rbxcompose", *words]
        return subprocess.Popen(
            command, env=self.environment, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )

    def do(self, *words: str) -> str:
        process = self.start(*words)
        output, _ = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, output
        return output

    def endpoint(self) -> str:
        """Return where its router listens, as soon as it does."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            process = self.start("ps", "--json")
            output, _ = process.communicate(timeout=PATIENCE)
            if process.returncode == 0 and (found := json.loads(output)["router"]["endpoint"]):
                return str(found)
        raise AssertionError("it did not come up")

    def pid_of(self, component: str) -> int:
        components = json.loads(self.do("ps", "--json"))["components"]
        return int(next(one["pid"] for one in components if one["name"] == component))


@pytest.fixture
def patrol(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Patrol]:
    robot = Patrol(tmp_path, tmp_path_factory.mktemp("runtime"))
    try:
        yield robot
    finally:
        if robot.process.poll() is None:
            robot.process.send_signal(signal.SIGINT)
            robot.process.communicate(timeout=PATIENCE)
        assert [one for one in titled(f"rbxcompose {NAME}: ") if one.is_running] == []


@pytest.mark.timeout(90)
def test_a_patrol_survives_a_stop_and_the_death_of_what_drives_it(patrol: Patrol) -> None:
    watcher = Watcher(patrol.endpoint())
    try:
        watcher.wait_until(lambda speed: speed > 0.3)
        patrol.do("stop")
        watcher.wait_until(lambda speed: speed == 0.0)
        patrol.do("release")
        watcher.listen()
        assert watcher.speeds[-1] == 0.0
        patrol.do("mission", "resume")
        watcher.wait_until(lambda speed: speed > 0.3)
        os.kill(patrol.pid_of("go_to"), signal.SIGKILL)
        watcher.wait_until(lambda speed: speed < 0.1)  # it brakes by itself: nobody is there to tell it
        watcher.wait_until(lambda speed: speed > 0.3)
    finally:
        watcher.close()
    output, _ = patrol.process.communicate(timeout=60)
    assert patrol.process.returncode == 0, output
    assert "process 'robot' was killed by SIGKILL; it is started again" in output
    assert "sent again" in output
    assert "mission patrol: success" in output
    assert "distance driven" in output
