"""`access: user`: a robot without a port, whose sockets only its user can reach."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from rbxcompose.bus.zenoh_session import open_client
from rbxcompose.runtime.folder import LOCK, SOCKET
from rbxcompose.runtime.processes import wait_until_ended
from tests.exposure.sockets import listeners
from tests.exposure.test_listeners import NOBODY, answers, running
from tests.runtime.real_robot import Robot, eventually


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    """A private robot."""
    with running(f"private_{os.getpid()}", "--access", "user") as made:
        yield made


def test_it_has_no_port_and_its_sockets_lie_in_a_private_folder(robot: Robot) -> None:
    found = listeners(process.pid for process in robot.processes())
    assert {listener.protocol for listener in found} == {"unix"}
    sockets = robot.folder.sockets
    places = {Path(listener.place) for listener in found}
    assert {path.name for path in places if path.parent != sockets} == {SOCKET}
    assert len(places) == 1 + 3  # control; router and two process groups
    assert sockets.stat().st_mode & 0o077 == 0


def test_this_users_programs_reach_it(robot: Robot) -> None:
    assert answers(robot.ps()["router"]["endpoint"], robot.name)


def test_a_killed_process_and_a_killed_router_come_back(robot: Robot) -> None:
    before = robot.ps()
    endpoint = before["router"]["endpoint"]
    for name in ("other", "router"):
        killed = next(process for process in robot.processes() if process.is_titled(f"rbxcompose {robot.name}: {name}"))
        killed.send_signal(signal.SIGKILL)
        assert not wait_until_ended([killed], 5.0)
        eventually(lambda: answers(endpoint, robot.name))
    eventually(lambda: {component["state"] for component in robot.ps()["components"]} == {"active"})
    assert robot.ps()["router"]["endpoint"] == endpoint


def test_sockets_that_somebody_removed_come_back(robot: Robot) -> None:
    endpoint = robot.ps()["router"]["endpoint"]
    shutil.rmtree(robot.folder.sockets)
    eventually(lambda: answers(endpoint, robot.name))
    assert robot.has_logged("files of the running robot were removed; they are restored")


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become somebody else")
def test_another_user_does_not_reach_it(robot: Robot) -> None:
    endpoint = robot.ps()["router"]["endpoint"]
    path = endpoint.removeprefix("unixsock-stream/")
    pid = os.fork()
    if pid == 0:
        signal.alarm(10)
        os.setgroups([])
        os.setuid(NOBODY)
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            os._exit(0 if connection.connect_ex(path) == 13 else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
    with pytest.raises(OSError, match="no router answers"):
        open_client(endpoint + "_of_nobody")


def test_a_folder_with_too_long_a_path_is_refused_before_anything_starts() -> None:
    base = Path(tempfile.mkdtemp(prefix="rbx" + "x" * 80))
    robot = Robot("far_away", base)
    process = robot.up("--access", "user")
    output, _ = process.communicate(timeout=30.0)
    left = robot.folder.path / LOCK
    assert (process.returncode, left.exists(), robot.processes()) == (1, False, [])
    assert "sockets need a path of less than 91 bytes" in output
    shutil.rmtree(base)
