"""Fixtures for the bus: one process on a stepped clock, and real ones with a router between them."""

from __future__ import annotations

import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator

import pytest

from rbxcompose.base.clock import MonotonicClock, SteppedClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import open_peer, open_router
from rbxcompose.bus.zenoh_transport import ZenohTransport

_PAUSE = 0.002  # [s] between two looks at what is awaited, unless something arrives


class Alone:
    """A process without others, on a stepped clock."""

    def __init__(self) -> None:
        self.errors: list[tuple[str, BaseException]] = []
        self.log: list[tuple[str, str]] = []
        self.clock = SteppedClock()
        self.scheduler = Scheduler(on_error=lambda owner, error: self.errors.append((owner, error)))
        self.bus = Bus(self.scheduler, self.clock, log=lambda owner, text: self.log.append((owner, text)))

    def settle(self, after: float = 0.0) -> None:
        """Let `after` [s] pass and do what is due then."""
        self.clock.advance_to(self.clock.now() + after)
        self.scheduler.advance(self.clock.now())


class Connected:
    """A process with a Zenoh session, driven by the thread of the test."""

    def __init__(self, port: int, is_woken: threading.Event) -> None:
        self.log: list[tuple[str, str]] = []
        self.errors: list[tuple[str, BaseException]] = []
        self.clock = MonotonicClock()
        self.scheduler = Scheduler(on_error=lambda owner, error: self.errors.append((owner, error)))
        self._woken: deque[tuple[str, Callable[[], None]]] = deque()
        self._is_woken = is_woken
        self.transport = ZenohTransport(open_peer(f"tcp/127.0.0.1:{port}"), self._wake)
        self.bus = Bus(self.scheduler, self.clock, transport=self.transport, log=self._note)

    def _note(self, owner: str, text: str) -> None:
        self.log.append((owner, text))

    def _wake(self, owner: str, callback: Callable[[], None]) -> None:
        self._woken.append((owner, callback))
        self._is_woken.set()

    def turn(self) -> None:
        while self._woken:
            self.scheduler.post(*self._woken.popleft())
        self.scheduler.advance(self.clock.now())


class Network:
    """A router on a free port and the processes that were connected to it."""

    def __init__(self) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port: int = probe.getsockname()[1]
        self._processes: list[Connected] = []
        self._is_woken = threading.Event()
        self.start_router()

    def start_router(self) -> None:
        self._router = open_router(tcp_endpoint(self.port))

    def stop_router(self) -> None:
        self._router.close()  # type: ignore[no-untyped-call]

    def process(self) -> Connected:
        self._processes.append(Connected(self.port, self._is_woken))
        return self._processes[-1]

    def until(self, condition: Callable[[], object], within: float = 30.0) -> float:
        """Let all processes run until `condition` holds; return how long that took [s]."""
        start = time.monotonic()
        while not condition():
            assert time.monotonic() - start < within, "it did not happen in time"
            self._is_woken.wait(_PAUSE)
            self._is_woken.clear()
            for process in self._processes:
                process.turn()
        return time.monotonic() - start

    def close(self) -> None:
        for process in self._processes:
            process.bus.close()
        self.stop_router()


@pytest.fixture
def alone() -> Alone:
    return Alone()


@pytest.fixture
def network() -> Iterator[Network]:
    threads = set(threading.enumerate())
    made = Network()
    try:
        yield made
    finally:
        made.close()
    # Zenoh's own threads show up here once they have called back; they are no threads of Python's.
    left = {
        thread
        for thread in threading.enumerate()
        if thread not in threads and not isinstance(thread, threading._DummyThread)
    }
    assert not left


@pytest.fixture
def one(network: Network) -> Connected:
    return network.process()


@pytest.fixture
def other(network: Network) -> Connected:
    return network.process()
