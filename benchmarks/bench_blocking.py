"""A fast topic beside long computations: how late it is if they run in another process, in its own, in a thread."""

from __future__ import annotations

import multiprocessing
import time
from dataclasses import dataclass
from typing import Any

from benchmarks.measuring import Row, Samples
from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import open_peer, open_router
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.runtime.process_group.connection import CallbackInbox
from rbxcompose.runtime.process_group.host import Host
from rbxcompose.sdk import Component, Config, In, component
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import instance

MEASURES = ("rbxcompose/bus", "rbxcompose/runtime/process_group")

COMPUTE = 0.02  # [s] per message
PERIOD = 0.005  # [s] between two messages of the fast topic
MESSAGES = 600
PORT = 17791


class NoConfig(Config):
    """Nothing to set."""


class _Cruncher(Component[NoConfig]):
    work = In(Float64, "work")

    def on_work(self, message: Float64) -> None:
        until = time.perf_counter() + COMPUTE
        while time.perf_counter() < until:
            sum(range(200))


@component("bench_cruncher")
class Cruncher(_Cruncher):
    """Computes for 20 ms per message."""


@component("bench_blocking_cruncher")
class BlockingCruncher(_Cruncher):
    """The same in a thread of its own."""

    blocking = True


@component("bench_fast")
class Fast(Component[NoConfig]):
    """Notes how late each message is handled."""

    fast = In(Float64, "fast", qos=Qos.EVENT)

    def configure(self) -> None:
        """Begin a list."""
        self.late: list[float] = []

    def on_fast(self, message: Float64) -> None:
        """Note the lateness [s]; clocks of one machine agree."""
        self.late.append(time.monotonic() - message.data)


@dataclass
class _Group:
    """A process group without a supervisor, driven by this process's main thread."""

    types: tuple[str, ...]

    def run(self) -> list[float]:
        clock, scheduler, inbox = MonotonicClock(), Scheduler(), CallbackInbox()
        transport = ZenohTransport(open_peer(f"tcp/127.0.0.1:{PORT}"), inbox.put)
        bus = Bus(scheduler, clock, transport=transport, log=lambda owner, text: None)
        parts = tuple(instance(name, name) for name in self.types)
        host = Host(
            Plan("bench", "bench", parts),
            parts,
            scheduler,
            clock,
            bus,
            lambda record: None,
            lambda notice: None,
            post=inbox.put,
        )
        host.configure()
        host.activate(self.types)
        deadline = clock.now() + 3.0 + 2 * MESSAGES * PERIOD
        found = host.hosted["bench_fast"] if "bench_fast" in self.types else None
        while clock.now() < deadline and not (found and _late(found.component)[MESSAGES - 1 :]):
            inbox.drain(scheduler)
            scheduler.advance(clock.now())
            time.sleep(0.0002)
        late = _late(found.component) if found else []
        host.shutdown()
        bus.close()
        return late


def _late(made: Any) -> list[float]:
    return made.late if isinstance(made, Fast) else []


def _feed() -> None:
    clock, scheduler = MonotonicClock(), Scheduler()
    inbox = CallbackInbox()
    transport = ZenohTransport(open_peer(f"tcp/127.0.0.1:{PORT}"), inbox.put)
    bus = Bus(scheduler, clock, transport=transport, log=lambda owner, text: None)
    fast = bus.publisher("feeder", "/fast", Float64, Qos.EVENT)
    work = bus.publisher("feeder", "/work", Float64, Qos.STATE)
    while not (fast.has_match and work.has_match):
        time.sleep(0.01)
    began = time.monotonic()
    for number in range(MESSAGES + 50):
        time.sleep(max(0.0, began + number * PERIOD - time.monotonic()))
        if number % 5 == 0:
            work(Float64(data=time.monotonic()))
        fast(Float64(data=time.monotonic()))
    time.sleep(0.2)
    bus.close()


def _serve(types: tuple[str, ...], results: Any) -> None:
    results.put(_Group(types).run())


def _measured(*groups: tuple[str, ...]) -> Samples:
    """Run groups, one process each, and return how late the fast topic was [s]."""
    context = multiprocessing.get_context("spawn")
    router = open_router(tcp_endpoint(PORT))
    results = context.Queue()
    processes = [context.Process(target=_serve, args=(types, results)) for types in groups]
    processes.append(context.Process(target=_feed))
    for process in processes:
        process.start()
    late: list[list[float]] = [results.get(timeout=60.0) for _ in groups]
    for process in processes:
        process.join(10.0)
    router.close()  # type: ignore[no-untyped-call]
    return Samples(tuple(sorted(late, key=len)[-1]))


def rows() -> list[Row]:
    """Return how late a topic of 200 Hz is handled beside 20 ms of computing, 40 times a second."""
    how = "200 Hz over Zenoh, handled; 40 times a second the other component computes for 20 ms"
    places = {
        "in another process": (("bench_fast",), ("bench_cruncher",)),
        "in a thread of the same process": (("bench_fast", "bench_blocking_cruncher"),),
        "in the same thread": (("bench_fast", "bench_cruncher"),),
    }
    found = {place: _measured(*groups) for place, groups in places.items()}
    peer = found.pop("in the same thread")
    return [
        Row(
            name=f"99 % of the messages of a fast topic, long computations {place}",
            unit="ms",
            how=how,
            ours=1000 * late.p99,
            peer=1000 * peer.p99,
            against="in the same thread",
            most=20.0,
        )
        for place, late in found.items()
    ]
