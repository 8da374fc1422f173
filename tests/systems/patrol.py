"""The patrol robot on two hosts, around a small square."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from rbxcompose.runtime.folder import RobotFolder, RobotState
from tests.conftest import ROOT
from tests.systems.namespaces import Hosts

ADDRESSES = {"r": "10.42.7.2", "d": "10.42.7.1"}
SPEED, ACCELERATION, DEADLINE, CYCLE = 0.3, 1.0, 0.25, 0.02  # [m/s], [m/s^2], [s], [s]
LONGEST = 40.0  # [s] for anything to happen
ENVIRONMENT = {"PYTHONPATH": str(ROOT)}
SYSTEM = """
rbx: 1
kind: System
name: two_hosts
hosts:
  r: {address: 10.42.7.2}
  d: {}
robots:
  NAME:
    robot: robots/robot.yaml
    profile: linked
    stop_within: 0.6 s
    on: d
    place: {base: r, battery: r}
"""


class PatrolOnHosts:
    """Its base and battery run on `r`, all else on `d`."""

    def __init__(self, hosts: Hosts, rounds: int = 1) -> None:
        self.name = f"two_hosts_{os.getpid()}"
        self.hosts = hosts
        self.environment: dict[str, dict[str, str]] = {}  # of a host
        self.shares: dict[str, subprocess.Popen[str]] = {}  # by host, the last one that was started
        folder = hosts.folder
        (folder / "robots").mkdir()
        (folder / "missions").mkdir()
        text = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")
        text = re.sub(r"\b([xy]): 1 m", r"\1: 0.3 m", text).replace("../../missions", "../missions")
        text = text.replace("runtime: 45 s", "runtime: 10 min")
        text = text.replace("../missions/patrol.yaml", f"{{file: ../missions/patrol.yaml, with: {{rounds: {rounds}}}}}")
        (folder / "robots/robot.yaml").write_text(text, encoding="utf-8")
        (folder / "missions/patrol.yaml").write_bytes((ROOT / "missions/patrol.yaml").read_bytes())
        (folder / "system.yaml").write_text(SYSTEM.replace("NAME", self.name), encoding="utf-8")
        self._motion = folder / "motion"

    def reach_by_ssh(self, host: str, program: Path) -> None:
        """Have a host reached by ssh, with its own program `rbxcompose`."""
        entry = f"  {host}: {{"
        self.change_system(entry, f"{entry}ssh: {host}, command: {program}, ")

    def change_system(self, before: str, after: str) -> None:
        """Change the text of the system."""
        path = self.hosts.folder / "system.yaml"
        path.write_text(path.read_text(encoding="utf-8").replace(before, after), encoding="utf-8")

    def stranger(self, host: str) -> str:
        """Return how a router without a certificate fares that dials `r` from a host: `linked` or `refused`."""
        process = self.hosts.start(host, sys.executable, "-m", "tests.systems.stranger", environment=ENVIRONMENT)
        return process.communicate(timeout=30)[0].strip()

    def rbx(self, host: str, *words: str) -> subprocess.Popen[str]:
        """Start a command of rbxcompose on a host."""
        environment = {**ENVIRONMENT, **self.environment.get(host, {})}
        return self.hosts.start(host, sys.executable, "-m", "rbxcompose", *words, environment=environment)

    def up(self, host: str) -> subprocess.Popen[str]:
        """Start the share of a host."""
        self.shares[host] = self.rbx(host, "up", "system.yaml", "--host", host)
        return self.shares[host]

    def change_mission(self, before: str, after: str) -> None:
        """Change the text of the mission."""
        path = self.hosts.folder / "missions/patrol.yaml"
        path.write_text(path.read_text(encoding="utf-8").replace(before, after), encoding="utf-8")

    def kill(self, host: str, process: str) -> float:
        """Kill a process of a share; return the time just before [s, monotonic]."""
        title = f"rbxcompose {self.name}: {process}".encode()
        pids = self.hosts.pids(host)
        (victim,) = [pid for pid in pids if Path(f"/proc/{pid}/cmdline").read_bytes().startswith(title)]
        before = time.monotonic()
        os.kill(victim, signal.SIGKILL)
        return before

    def is_active(self, host: str) -> bool:
        """Return whether all components of a share are active and all its processes are there."""
        state = self.state(host)
        alive = len(state.alive()) if state is not None else 0
        return (
            state is not None
            and alive >= len(state.processes)
            and all(component.state == "active" for component in state.components)
        )

    def state(self, host: str) -> RobotState | None:
        """Return what the share of a host tells of itself."""
        return RobotFolder(self.hosts.folder / host / "rbxcompose" / self.name).read_state()

    def log(self, host: str) -> str:
        """Return the log of a host."""
        path = self.hosts.folder / host / "rbxcompose" / self.name / "log.jsonl"
        return path.read_text(encoding="utf-8") if path.exists() else ""

    def watch(self) -> None:
        """Write down how the base moves, from now on."""
        self.wait_until(lambda: (state := self.state("r")) is not None and state.router is not None)
        state = self.state("r")
        assert state is not None
        assert state.router is not None
        words = (sys.executable, "-m", "tests.systems.motion", state.router, str(self._motion))
        self.hosts.start("r", *words, environment=ENVIRONMENT)

    def motion(self) -> list[tuple[float, bool]]:
        """Return when it moved and when it stood still so far [s, monotonic]."""
        if not self._motion.exists():
            return []
        lines = [line.split() for line in self._motion.read_text(encoding="utf-8").splitlines()]
        return [(float(words[0]), words[1] == "1") for words in lines if len(words) == 2]

    def has_moved_since(self, since: float) -> bool:
        """Return whether it moved after `since`."""
        return any(moves for at, moves in self.motion() if at > since)

    @property
    def is_moving(self) -> bool:
        """Return whether it moved when it was last seen."""
        return bool(self.motion()) and self.motion()[-1][1]

    def rest_after(self, since: float) -> float | None:
        """Return when it first stood still after `since`, if it did."""
        return next((at for at, moves in self.motion() if at > since and not moves), None)

    def wait_until(self, holds: Callable[[], bool], within: float = LONGEST) -> None:
        """Wait until something holds.

        Raises:
            AssertionError: if it takes longer; it shows how the log of each host ends.
        """
        deadline = time.monotonic() + within
        while not holds():
            assert time.monotonic() < deadline, f"it did not happen in time\n{self._ends_of_logs()}"
            time.sleep(0.02)

    def _ends_of_logs(self) -> str:
        return "\n".join(line for host in self.hosts.addresses for line in [host, *self.log(host).splitlines()[-30:]])
