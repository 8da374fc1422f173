"""The patrol robot in real processes, around a small square, and what may be left of it when it is over: its log."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import dropwhile
from pathlib import Path
from types import MappingProxyType
from typing import Self

from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.log import NAME as LOG
from rbxcompose.runtime.processes import Process, titled, wait_until_ended
from tests.commands import command
from tests.conftest import ROOT
from tests.faults.observer import COMMAND, LOOK, MOTION, PATIENCE, Observer
from tests.forked import RBXCOMPOSE, Forked
from tests.simulated_faults.safety import Base, Laws, violations

NAME = f"turtlebot_with_faults_{os.getpid()}"
TIMEOUT, CYCLE, SPEED = 0.5, 0.02, 0.5  # [s], [s], [m/s]
BRAKING = 1.0, 3.0  # [m/s^2], [rad/s^2]
BASE = Base(COMMAND, MOTION, "world", TIMEOUT, CYCLE, BRAKING)
LONGEST_STOP = TIMEOUT + 2 * CYCLE + SPEED / BRAKING[0]  # [s] from the last command to rest
LATE = 0.15  # [s] that a loaded machine may hold up what is seen from outside
MEETING = 0.5  # [s] until the observer hears a process that has come back, and the base may have heard before
SETTINGS = {
    "args.speed": f"{SPEED} m/s",
    "components.base.max_turn_rate": "180 deg/s",
    "components.battery.runtime": "10 min",
}
WORLD, ROBOT, MISSION, ROUTER, PARENT, SUPERVISOR = "world", "robot", "mission", "router", "parent", "supervisor"
NONE: Mapping[str, object] = MappingProxyType({})
SHARED_MEMORY = re.compile(r"/dev/shm/\S+")


class Patrol:
    """The robot, up in the foreground of a process; at its end, nothing but its log may be left."""

    def __init__(
        self, folder: Path, *, times: int = 1, hears_commands: bool = True, more: Mapping[str, object] = NONE
    ) -> None:
        """Start it in an empty folder, to go around so many times, with `more` settings."""
        self._folder = folder
        (folder / "robots").mkdir()
        (folder / "missions").mkdir()
        (folder / "temporary").mkdir()
        text = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")
        text = text.replace("name: turtlebot", f"name: {NAME}").replace("../../missions", "../missions")
        (folder / "robots/robot.yaml").write_text(re.sub(r"\b([xy]): 1 m", r"\1: 0.5 m", text), encoding="utf-8")
        (folder / "missions/patrol.yaml").write_bytes((ROOT / "missions/patrol.yaml").read_bytes())
        self.environment = {
            **os.environ,
            "XDG_RUNTIME_DIR": str(folder),
            "TMPDIR": str(folder / "temporary"),
            "PYTHONPATH": str(ROOT),
            "NO_COLOR": "1",
        }
        self.state = RobotFolder(folder / "rbxcompose" / NAME)
        self.output = ""
        self._shared: set[str] = set()
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]  # of its own: another robot may take the next one that is free
        settings = {**SETTINGS, "missions.patrol.with.rounds": times, "bus.port": port, **more}
        self.process = self.start(
            "up", "robots/robot.yaml", *(f"--set={key}={setting}" for key, setting in settings.items())
        )
        self.observer = Observer(self._router(), hears_commands=hears_commands)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.observer.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        self._wait()
        for process in self.running():
            process.send_signal(signal.SIGKILL)

    def start(self, *words: str) -> subprocess.Popen[str]:
        """Start a command on it."""
        return Forked(
            [*RBXCOMPOSE, *words],
            env=self.environment,
            cwd=self._folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def do(self, *words: str) -> str:
        """Run a command on it and return what that printed."""
        done = command(*words, environment=self.environment, folder=self._folder)
        output = done.stdout + done.stderr
        assert done.returncode == 0, output
        return output

    @property
    def is_up(self) -> bool:
        """Tell whether the run goes on."""
        return self.process.poll() is None

    def running(self) -> list[Process]:
        """Return all of its processes."""
        return [process for process in titled(f"rbxcompose {NAME}: ") if process.is_running]

    def named(self, name: str) -> Process | None:
        """Return the process of this name, if it is there."""
        found = titled(f"rbxcompose {NAME}: {name}")
        return next((process for process in found if process.is_running), None)

    def wait_for(self, holds: Callable[[], bool]) -> bool:
        """Wait until something holds, as long as the run goes on; tell whether it does."""
        deadline = time.monotonic() + PATIENCE
        while self.is_up and time.monotonic() < deadline:
            if holds():
                return True
            time.sleep(LOOK)
        return holds()

    def wait_for_end(self, seconds: float) -> bool:
        """Wait until all of its processes have ended; tell whether they have within so long."""
        return not wait_until_ended(self.running(), seconds)

    def note_shared_memory(self) -> None:
        """Note which files of shared memory its processes use now, but for those of the observer."""
        self._shared.update(*map(_shared_memory, self.running()))
        self._shared -= _shared_memory(Process.of(os.getpid()))

    def end(self) -> int:
        """Wait for the end of the run and return its exit code."""
        self._wait()
        return self.process.returncode

    def left_behind(self) -> list[str]:
        """Return what is left once it is over: processes, ports, files."""
        left = [f"process {process.pid}" for process in self.running()]
        port = int(self.observer.router.rpartition(":")[2])
        try:
            socket.create_server(("127.0.0.1", port)).close()
        except OSError:
            left.append(f"port {port}")
        files = [*self.state.path.glob("*"), *(self._folder / "temporary").rglob("*"), *map(Path, self._shared)]
        return left + [str(file) for file in files if file.exists() and not file.name.startswith(LOG)]

    def unsafe(self) -> list[str]:
        """Return in words where it moved without a live command, as seen from outside since the first one."""
        story = dropwhile(lambda velocity: velocity.topic != COMMAND, list(self.observer.story))
        sent = [
            replace(velocity, time=velocity.time - MEETING) if velocity.topic == COMMAND else velocity
            for velocity in story
        ]
        laws = Laws(bases=[BASE], slack=MEETING + LATE)
        return [str(violation) for violation in violations(laws, sorted(sent, key=lambda velocity: velocity.time))]

    def _wait(self) -> None:
        if not self.process.stdout or self.process.stdout.closed:
            return
        try:
            self.output, _ = self.process.communicate(timeout=3 * PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.output, _ = self.process.communicate()

    def _router(self) -> str:
        found: list[str] = []

        def is_told() -> bool:
            state = self.state.read_state()
            if (
                state is not None
                and state.router
                and all(component.state == "active" for component in state.components)
            ):
                found.append(state.router)
            return bool(found)

        if not self.wait_for(is_told):
            self.process.kill()
            raise AssertionError(f"it did not come up: {self.process.communicate()[0]}")
        return found[0]


def _shared_memory(process: Process) -> set[str]:
    try:
        return set(SHARED_MEMORY.findall(Path(f"/proc/{process.pid}/maps").read_text(encoding="utf-8")))
    except (FileNotFoundError, ProcessLookupError):
        return set()  # it has just ended
