"""What a running robot listens on, and what becomes of those who attack that: they are refused, the robot goes on."""

from __future__ import annotations

import os
import selectors
import shutil
import signal
import socket
import stat
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rbxcompose.bus.transport import LONGEST_WAIT, TransportReply
from rbxcompose.bus.zenoh_session import open_client
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.runtime import control
from rbxcompose.runtime.control import ControlServer, ask
from rbxcompose.runtime.folder import SOCKET, RobotFolder
from rbxcompose.runtime.process_group.connection import probe_key
from rbxcompose.runtime.requests import RobotStatus
from tests.exposure.attacks import ON_CONTROL, ON_ROUTER, REQUESTS, sending
from tests.exposure.sockets import Listener, listeners
from tests.loops import for_all
from tests.runtime.real_robot import PATIENCE, Robot, eventually
from tests.soak import Soak

NOBODY = 65534  # uid
QUICK_ANSWER = 2.0  # [s]


@contextmanager
def running(name: str, *options: str) -> Iterator[Robot]:
    """A robot that is up, and leaves nothing behind but its logs."""
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(name, base)
    process = made.up("-d", *options)
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, output
    yield made
    down = made.do("down")
    left = made.processes()
    for one in left:
        one.send_signal(signal.SIGKILL)
    files = {path.name for path in made.folder.path.iterdir()} - {"log.jsonl", "log.1.jsonl"}
    shutil.rmtree(base)
    assert (down.returncode, left, files) == (0, [], set())


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    """A robot that is up for all tests of this module, and whose port is free afterwards."""
    with running(f"exposed_{os.getpid()}") as made:
        port = made.ps()["router"]["endpoint"].rpartition(":")[2]
        yield made
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", int(port))) != 0


@pytest.fixture(scope="module")
def refused(soak: Soak) -> Iterator[list[str]]:
    tried: list[str] = []
    yield tried
    soak.tell("attacks on listeners", len(tried), 0, "all refused: the robot went on, at the same processes")


def found(robot: Robot) -> list[Listener]:
    return listeners(process.pid for process in robot.processes())


def alive(robot: Robot) -> list[int]:
    return sorted(process.pid for process in robot.processes())


def steps(robot: Robot) -> int:
    return sum(text.startswith("step ") for text in robot.texts("first"))


def test_a_robot_listens_on_the_loopback_interface_only(robot: Robot) -> None:
    tcp = [listener for listener in found(robot) if listener.protocol != "unix"]
    assert tcp
    assert all(listener.is_loopback for listener in tcp), tcp
    assert {listener.protocol for listener in tcp} == {"tcp"}


def test_each_process_has_one_port_at_most_and_the_supervisor_none(robot: Robot) -> None:
    tcp = [listener.pid for listener in found(robot) if listener.protocol == "tcp"]
    assert len(tcp) == len(set(tcp))
    shown = robot.ps()
    assert shown["supervisor"]["pid"] not in tcp
    assert shown["router"]["endpoint"].rpartition(":")[2] in {listener.place for listener in found(robot)}


def test_the_only_unix_socket_is_that_of_the_supervisor_in_a_folder_of_its_own(robot: Robot) -> None:
    unix = [listener for listener in found(robot) if listener.protocol == "unix"]
    assert [listener.pid for listener in unix] == [robot.ps()["supervisor"]["pid"]]
    assert not any(listener.place.startswith("@") for listener in unix)
    folder = robot.folder.path
    assert [stat.S_IMODE(path.stat().st_mode) for path in (folder, folder.parent)] == [0o700, 0o700]
    assert stat.S_ISSOCK((folder / SOCKET).stat().st_mode)
    assert all(stat.S_IMODE(path.stat().st_mode) & 0o077 == 0 for path in folder.iterdir() if path.name != SOCKET)


def knock(robot: Robot) -> socket.socket:
    """Connect with the control socket."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    connection.settimeout(QUICK_ANSWER)
    try:
        with control._short_address(robot.folder.path) as address:
            connection.connect(address)
    except OSError:
        connection.close()
        raise
    return connection


def test_a_request_that_makes_no_sense_is_refused(robot: Robot, refused: list[str]) -> None:
    before = alive(robot)
    for name, data in REQUESTS.items():
        with sending(data, lambda: knock(robot)):
            assert ask(robot.folder, RobotStatus(), timeout=QUICK_ANSWER), name
        refused.append(name)
    assert_goes_on(robot, before)


@pytest.mark.parametrize("name", ON_CONTROL)
def test_an_attack_on_the_control_socket_is_refused(robot: Robot, refused: list[str], name: str) -> None:
    before = alive(robot)
    with ON_CONTROL[name](lambda: knock(robot)):
        assert_goes_on(robot, before)
    assert ask(robot.folder, RobotStatus(), timeout=QUICK_ANSWER)
    refused.append(name)


@for_all("name", ON_ROUTER)
def test_an_attack_on_the_router_is_refused(robot: Robot, refused: list[str], name: str) -> None:
    before, endpoint = alive(robot), robot.ps()["router"]["endpoint"]
    port = int(endpoint.rpartition(":")[2])
    with ON_ROUTER[name](lambda: socket.create_connection(("127.0.0.1", port), QUICK_ANSWER)):
        assert_goes_on(robot, before)
    eventually(lambda: answers(endpoint, robot.name))
    assert alive(robot) == before
    refused.append(name)


def assert_goes_on(robot: Robot, before: list[int]) -> None:
    """Require that the supervisor answers, the components make their steps, and no process was replaced."""
    status = ask(robot.folder, RobotStatus(), timeout=QUICK_ANSWER)
    assert {component.state for component in status.components} == {"active"}
    count = steps(robot)
    eventually(lambda: steps(robot) > count)
    assert alive(robot) == before


def answers(endpoint: str, name: str) -> bool:
    """Tell whether a newcomer reaches the processes of a robot through its router."""
    heard: list[TransportReply] = []
    try:
        transport = ZenohTransport(open_client(endpoint), lambda owner, callback: None)
    except OSError:
        return False
    transport.ask(probe_key(name), b"", b"", heard.append, of_all=True, within=LONGEST_WAIT)
    deadline = time.monotonic() + 0.5
    while not any(not reply.error for reply in heard) and time.monotonic() < deadline:
        time.sleep(0.005)
    transport.close()
    return any(not reply.error for reply in heard)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become somebody else")
def test_another_user_is_not_heard_even_if_the_folder_were_open() -> None:
    folder = RobotFolder(Path(tempfile.mkdtemp(prefix="rbx")))
    with selectors.DefaultSelector() as selector:
        server = ControlServer(folder, selector)
        server.handle = lambda request, number: server.answer(number, "heard")
        folder.path.chmod(0o777)
        (folder.path / SOCKET).chmod(0o777)
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        reading, writing = os.pipe()

        pid = os.fork()
        if pid == 0:
            signal.alarm(10)
            os.setgroups([])
            os.setuid(NOBODY)
            os._exit(0 if _is_refused(connection, folder.path / SOCKET, writing) else 1)
        os.read(reading, 1)
        for key, _ in selector.select(5.0):
            key.data()
        assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
        assert not server._connections
        server.close()
    for descriptor in (reading, writing):
        os.close(descriptor)
    connection.close()
    shutil.rmtree(folder.path)


def _is_refused(connection: socket.socket, path: Path, writing: int) -> bool:
    """Knock at a control socket, tell by `writing` that it is done, and return whether nothing is answered."""
    connection.settimeout(5.0)
    connection.connect(str(path))
    os.write(writing, b"x")
    try:
        connection.sendall(b'{"type": "robot.RobotStatus"}\n')
        return connection.recv(100) == b""
    except (BrokenPipeError, ConnectionResetError):
        return True
