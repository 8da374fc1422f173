"""A session that carries nothing any more is noticed, opened again, and has all that it had."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from functools import partial

import pytest

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.renewal import RenewableTransport
from rbxcompose.bus.transport import LONGEST_WAIT, TransportReply
from rbxcompose.bus.zenoh_session import open_client, open_peer, open_router
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.runtime.process_group.connection import (
    LIFELINE_BEATS,
    MISSES,
    Lifeline,
    PeerChecker,
    Probe,
    ProbeResult,
    answer,
    probe_key,
)
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.ports import Qos

ROBOT = "toys"
PATIENCE = 60.0  # [s]


# The decision


def test_a_session_is_stuck_after_three_misses_in_a_row_and_not_before() -> None:
    probe = Probe(expects_router=True)
    assert [probe.judge(ProbeResult.NOTHING, is_router_up=False) for _ in range(MISSES)] == [False, False, True]


def test_one_answer_of_anybody_clears_the_misses() -> None:
    probe = Probe(expects_router=True)
    heard = [ProbeResult.NOTHING, ProbeResult.NOTHING, ProbeResult.ANSWER] * 20
    assert not any(probe.judge(message, is_router_up=False) for message in heard)


def test_a_dead_router_is_no_stuck_session() -> None:
    probe = Probe(expects_router=True)
    assert not any(probe.judge(ProbeResult.NOBODY, is_router_up=False) for _ in range(100))


def test_a_process_that_is_alone_with_a_router_from_elsewhere_is_not_stuck() -> None:
    probe = Probe(expects_router=False)
    assert not any(probe.judge(ProbeResult.NOBODY, is_router_up=True) for _ in range(100))


def test_a_router_of_ours_that_runs_and_cannot_be_reached_is_a_miss() -> None:
    probe = Probe(expects_router=True)
    assert [probe.judge(ProbeResult.NOBODY, is_router_up=True) for _ in range(MISSES)] == [False, False, True]


def test_renewals_that_do_not_help_become_rarer_until_one_does() -> None:
    probe = Probe(expects_router=True)
    stuck = [number for number in range(1, 40) if probe.judge(ProbeResult.NOTHING, is_router_up=True)]
    assert stuck == [3, 9, 21]
    probe.judge(ProbeResult.ANSWER, is_router_up=True)
    assert [probe.judge(ProbeResult.NOTHING, is_router_up=True) for _ in range(MISSES)] == [False, False, True]


def test_after_a_miss_all_are_asked_until_one_has_answered() -> None:
    probe = Probe(expects_router=True)
    doubts = [probe.is_in_doubt]
    for heard in (ProbeResult.NOTHING, ProbeResult.NOTHING, ProbeResult.ANSWER):
        probe.judge(heard, is_router_up=True)
        doubts.append(probe.is_in_doubt)
    assert doubts == [False, True, True, False]


# The real thing


class Proxy:
    """Stands between a session and its router; `freeze` keeps all its links open and lets nothing through any more.

    Links that are opened afterwards stay silent as well until `thaw`; those of before never come back.
    """

    def __init__(self, port: int) -> None:
        self._target = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._is_frozen = False
        self._sockets: list[socket.socket] = [self._listener]
        self._threads = [threading.Thread(target=self._accept)]
        self._threads[0].start()

    def freeze(self) -> None:
        self._is_frozen = True

    def thaw(self) -> None:
        self._is_frozen = False

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                self._sockets.append(near)
                if self._is_frozen:
                    continue
                far = socket.create_connection(("127.0.0.1", self._target))
                self._sockets.append(far)
                for source, sink in ((near, far), (far, near)):
                    self._threads.append(threading.Thread(target=self._pump, args=(source, sink)))
                    self._threads[-1].start()

    def _pump(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while chunk := source.recv(65536):
                if self._is_frozen:
                    return
                sink.sendall(chunk)
            sink.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        for one in self._sockets:
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
        for thread in self._threads:
            thread.join()


class Probed:
    """A process whose session is watched, driven by the thread of the test; it beats only when told to."""

    def __init__(self, port: int, name: str = "robot") -> None:
        router = f"tcp/127.0.0.1:{port}"
        self.log: list[str] = []
        self.clock, self.scheduler = MonotonicClock(), Scheduler()
        self._woken: deque[tuple[str, Callable[[], None]]] = deque()
        self.sessions: list[ZenohTransport] = []
        self.transport = RenewableTransport(self._open(router))
        self.bus = Bus(self.scheduler, self.clock, transport=self.transport, log=lambda owner, text: None)
        self.lifeline = Lifeline(
            ROBOT,
            self.transport,
            lambda: self._open(router),
            router,
            roll=PeerChecker(self.transport, ROBOT, "", name),
            owns_router=True,
            post=self._post,
            log=self.log.append,
        )

    def _open(self, router: str) -> ZenohTransport:
        self.sessions.append(ZenohTransport(open_peer(router), self._post))
        return self.sessions[-1]

    def _post(self, owner: str, callback: Callable[[], None]) -> None:
        self._woken.append((owner, callback))

    def probe(self) -> None:
        for _ in range(LIFELINE_BEATS):
            self.lifeline.beat()

    def turn(self) -> None:
        while self._woken:
            self.scheduler.post(*self._woken.popleft())
        self.scheduler.advance(self.clock.now())


class Visitor:
    """A process that is connected with the router only, so that all it hears comes through the router."""

    def __init__(self, port: int) -> None:
        self.clock, self.scheduler = MonotonicClock(), Scheduler()
        self._woken: deque[tuple[str, Callable[[], None]]] = deque()
        self.transport = ZenohTransport(
            open_client(f"tcp/127.0.0.1:{port}"), lambda owner, callback: self._woken.append((owner, callback))
        )
        self.bus = Bus(self.scheduler, self.clock, transport=self.transport, log=lambda owner, text: None)
        self.turn = lambda: Probed.turn(self)  # type: ignore[arg-type]


@pytest.fixture
def port() -> Iterator[int]:
    """The port of a robot's router."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        free: int = listener.getsockname()[1]
    transport = ZenohTransport(open_router(tcp_endpoint(free)), lambda owner, callback: None)
    transport.serve(probe_key(ROBOT), answer)
    yield free
    transport.close()


def until(holds: Callable[[], object], *processes: Probed | Visitor | Beating) -> None:
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline, "it never came true"
        for process in processes:
            process.turn()
        time.sleep(0.002)


def test_a_session_that_is_sound_is_left_alone(port: int) -> None:
    robot = Probed(port)
    answers: list[TransportReply] = []
    take = lambda one: None if one.error else answers.append(one)  # noqa: E731
    ask = partial(robot.transport.ask, probe_key(ROBOT), b"", b"", take, of_all=True, within=LONGEST_WAIT)
    until(lambda: ask() and answers, robot)  # there is a link now
    for _ in range(2 * MISSES):
        robot.probe()
        until(lambda: robot.lifeline.result is ProbeResult.ANSWER, robot)
    assert (robot.log, len(robot.sessions)) == ([], 1)
    robot.bus.close()


def test_a_stuck_session_is_opened_again_with_all_that_was_declared(port: int) -> None:
    with closing(Proxy(port)) as proxy:
        robot, visitor = Probed(proxy.port), Visitor(port)
        heard: list[float] = []
        told: list[float] = []
        replies: list[Reply[Trigger.Response]] = []
        robot.bus.subscribe("toy", "told", Float32, Qos.EVENT, lambda message: told.append(message.data))
        robot.bus.serve("toy", "ring", Trigger, lambda request: Trigger.Response(success=True))
        latched = robot.bus.publisher("toy", "map", Float32, Qos.LATCHED)
        latched(Float32(data=7.0))
        ring = visitor.bus.client("visitor", "ring", Trigger)
        tell = visitor.bus.publisher("visitor", "told", Float32, Qos.EVENT)
        until(lambda: ring.is_available and tell.has_match, robot, visitor)

        proxy.freeze()
        until(lambda: not ring.is_available, robot, visitor)  # the lease of the link has passed
        for _ in range(MISSES + 1):
            robot.probe()
        assert robot.log == ["the session on the bus no longer carries anything; opening it again"]
        latched(Float32(data=8.0))
        proxy.thaw()
        until(lambda: len(robot.log) == 2 and ring.is_available and tell.has_match, robot, visitor)

        assert robot.log[1].startswith("the session on the bus is new")
        visitor.bus.subscribe("visitor", "map", Float32, Qos.LATCHED, lambda message: heard.append(message.data))
        ring(Trigger.Request(), replies.append)
        tell(Float32(data=1.0))
        until(lambda: heard and told and replies, robot, visitor)
        assert (heard, told, [reply.response is not None for reply in replies]) == ([8.0], [1.0], [True])
        robot.bus.close()
        visitor.bus.close()


def lose_link(transport: ZenohTransport, other: ZenohTransport) -> None:
    """Shut the connection between two sessions of this process, which Zenoh made when they learnt of each other."""
    (link,) = [link for link in transport._session.info.links() if str(link.zid) == other.session]
    ends = {str(end).partition("/")[2] for end in (link.src, link.dst)}
    for descriptor in map(int, os.listdir("/proc/self/fd")):
        with suppress(OSError):  # no socket, or one that listens
            end = socket.socket(fileno=descriptor)
            try:
                addresses = (end.getsockname(), end.getpeername()) if end.family == socket.AF_INET else ()
                if {"{}:{}".format(*address) for address in addresses} == ends:
                    end.shutdown(socket.SHUT_RDWR)
            finally:
                end.detach()  # it is Zenoh's


def test_two_that_have_lost_their_link_find_each_other_again(port: int) -> None:
    router = ZenohTransport(
        open_client(f"tcp/127.0.0.1:{port}"), lambda owner, callback: None
    )  # reaches all, as it does
    roll = PeerChecker(router, ROBOT, "", "router")
    robot, world = Probed(port, "robot"), Probed(port, "world")
    heard: list[float] = []
    robot.bus.subscribe("toy", "told", Float32, Qos.EVENT, lambda message: heard.append(message.data))
    tell = world.bus.publisher("visitor", "told", Float32, Qos.EVENT)
    until(lambda: robot.sessions[0]._session.info.links() and tell.has_match, robot, world)
    until(lambda: len(robot.sessions[0]._session.info.links()) == 2, robot, world)

    lose_link(robot.sessions[0], world.sessions[0])
    until(lambda: not tell.has_match, robot, world)
    until(lambda: len(robot.log) == 2, Beating(roll, robot, world))
    assert robot.log[0] == "the session on the bus does not reach world any more, as others do; opening it again"
    assert (world.log, len(world.sessions)) == ([], 1)
    until(lambda: tell.has_match, robot, world)
    tell(Float32(data=1.0))
    until(lambda: heard, robot, world)
    for bus in (robot.bus, world.bus, router):
        bus.close()


class Beating:
    """The parts of a robot, which beat faster than they do in a process, but so that answers still arrive in time."""

    def __init__(self, roll: PeerChecker, *processes: Probed) -> None:
        self._roll, self._processes, self._due = roll, processes, 0.0

    def turn(self) -> None:
        for process in self._processes:
            process.turn()
        if time.monotonic() > self._due:
            self._due = time.monotonic() + 0.02
            self._roll.beat()
            for process in self._processes:
                process.lifeline.beat()
