"""Peers that may be installed on this machine; the project does without them, and says so where one is missing."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from benchmarks.measuring import ROOT

PATIENCE = 60.0  # [s] for anything to come up
LOOK = 0.002  # [s] between two looks
ROS_PYTHON = "/usr/bin/python3"  # for which Debian's packages of ROS 1 are made
ROS_PACKAGES = ("rospy", "dynamic_reconfigure.server", "geometry_msgs.msg", "std_srvs.srv")


def free_port() -> int:
    """Return a port of the loopback interface that nobody has."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for(condition: Callable[[], object], what: str) -> None:
    """Wait until `condition` holds.

    Raises:
        TimeoutError: if it does not.
    """
    deadline = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"{what}: it takes too long")
        time.sleep(LOOK)


@contextmanager
def running(command: Sequence[str], environment: Mapping[str, str], folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a program in a folder, with all that it starts, and end them as Ctrl-C does."""
    process = subprocess.Popen(
        command,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        cwd=folder,  # not ours, whose environment of Python dora would take
        start_new_session=True,
    )
    try:
        yield process
    finally:
        _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.send_signal(signal.SIGINT)
    try:
        process.wait(20.0)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@dataclass(frozen=True, slots=True)
class Ros:
    """ROS 1 with a master of our own on the loopback interface."""

    folder: Path
    port: int

    name = "ROS 1"
    package = "ROS 1 (rospy, roslaunch, dynamic_reconfigure, geometry_msgs, std_srvs)"

    @staticmethod
    @cache
    def is_here() -> bool:
        """Tell whether it is installed, with what our nodes import: without that, they would never come up."""
        if not all(map(shutil.which, (ROS_PYTHON, "roslaunch", "rosmaster", "rostopic"))):
            return False
        imports = f"import {', '.join(ROS_PACKAGES)}"
        return subprocess.run([ROS_PYTHON, "-c", imports], stderr=subprocess.DEVNULL).returncode == 0

    @property
    def environment(self) -> dict[str, str]:
        """Return what its programs have to know."""
        return {
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}/",
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(self.folder / "ros"),
            "ROS_PACKAGE_PATH": f"{self.folder}:/usr/share",
            "PYTHONPATH": str(ROOT),
            "PATH": "/usr/bin:/bin",
        }

    @contextmanager
    def master(self) -> Iterator[None]:
        """Run the master."""
        master = [ROS_PYTHON, "/usr/bin/rosmaster", "--core", "-p", str(self.port)]
        with running(master, self.environment, self.folder):
            wait_for(self._answers, "rosmaster")
            yield

    def _answers(self) -> bool:
        try:
            socket.create_connection(("127.0.0.1", self.port), 1.0).close()
        except OSError:
            return False
        return True


@dataclass(frozen=True, slots=True)
class Dora:
    """dora, whose Python package is beside its command."""

    folder: Path

    name = "dora"

    @staticmethod
    def is_here() -> bool:
        """Tell whether it is installed."""
        return shutil.which("dora") is not None

    @property
    def environment(self) -> dict[str, str]:
        """Return what its programs have to know."""
        return {"PATH": f"{Path(str(shutil.which('dora'))).parent}:/usr/bin:/bin", "PYTHONPATH": str(ROOT)}


def missing() -> str:
    """Name what is not installed, in brackets for the end of a sentence; empty if all is here."""
    names = [peer.name for peer in (Ros, Dora) if not peer.is_here()]
    return f" ({' and '.join(names)} not installed here)" if names else ""
