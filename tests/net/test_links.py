"""Links to the router that are late, slow, cut or half-open: nobody is taken for gone in vain, and all come back."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from random import Random

import pytest

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import open_router
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.runtime.process_group.connection import MISSES, ProbeResult, answer, probe_key
from rbxcompose.sdk.ports import Qos
from tests.net.proxy import Proxy
from tests.runtime.test_lifeline import ROBOT, Probed, Visitor, until
from tests.soak import Soak

QUICK, MANY = 1, 17  # rounds of each of the three kinds
RECOVERS = 4.0  # [s] after the fault has ended


@dataclass
class Count:
    """What was seen."""

    rounds: int = 0
    false_deletes: int = 0
    recoveries: list[float] = field(default_factory=list)  # [s]


@dataclass
class Stage:
    """A process of a robot behind a proxy, and a visitor at the router who hears it."""

    proxy: Proxy
    robot: Probed
    visitor: Visitor

    def __post_init__(self) -> None:
        self.result: list[float] = []
        self.losses = 0
        self.robot.bus.serve("toy", "ring", Trigger, lambda request: Trigger.Response(success=True))
        self.tell = self.robot.bus.publisher("toy", "told", Float32, Qos.STATE)
        self.visitor.bus.subscribe(
            "visitor", "told", Float32, Qos.STATE, lambda message: self.result.append(message.data)
        )
        self.ring = self.visitor.bus.client("visitor", "ring", Trigger)
        self.ring.watch(self._changed)
        self.until(lambda: self.ring.is_available and self.tell.has_match)

    def _changed(self, is_available: bool) -> None:
        self.losses += not is_available

    def until(self, holds: Callable[[], object]) -> None:
        """Let both run until something holds."""
        until(holds, self.robot, self.visitor)

    def arrives(self) -> float:
        """Speak until something that is said from now on is heard; return how long that took [s]."""
        began, first = time.monotonic(), len(self.result)
        spoken = 0.0

        def heard() -> bool:
            nonlocal spoken
            if time.monotonic() - spoken > 0.02:
                spoken = time.monotonic()
                self.tell(Float32(data=spoken))
            return any(value > began for value in self.result[first:])

        self.until(heard)
        return time.monotonic() - began


@pytest.fixture(scope="module")
def count(soak: Soak) -> Iterator[Count]:
    count = Count()
    yield count
    slowest = max(count.recoveries, default=0.0)
    note = f"{count.false_deletes} wrongly taken for gone; the slowest was back after {slowest:.1f} s"
    soak.tell("links that fail", count.rounds, count.false_deletes, note)


@pytest.fixture
def stage() -> Iterator[Stage]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
    router = ZenohTransport(open_router(tcp_endpoint(port)), lambda owner, callback: None)
    router.serve(probe_key(ROBOT), answer)
    with Proxy(port) as proxy:
        made = Stage(proxy, Probed(proxy.port), Visitor(port))
        try:
            yield made
        finally:
            made.robot.bus.close()
            made.visitor.bus.close()
    router.close()


def rounds(soak: Soak) -> Iterator[Random]:
    return (Random(seed) for seed in range(soak.examples(QUICK, MANY)))


@pytest.mark.timeout(120)
def test_a_link_that_is_late_or_slow_is_no_loss(stage: Stage, soak: Soak, count: Count) -> None:
    for chance in rounds(soak):
        stage.proxy.conditions.delay = delay = chance.uniform(0.05, 0.3)
        stage.proxy.conditions.rate = chance.choice([0.0, 50_000.0])
        assert stage.arrives() >= delay
        end = time.monotonic() + chance.uniform(0.5, 1.0)
        stage.until(lambda end=end: time.monotonic() > end)  # type: ignore[misc]
        stage.proxy.conditions.delay = stage.proxy.conditions.rate = 0.0
        count.recoveries.append(stage.arrives())
        count.rounds, count.false_deletes = count.rounds + 1, count.false_deletes + stage.losses
        assert stage.losses == 0, chance


@pytest.mark.timeout(120)
def test_a_link_that_is_cut_comes_back(stage: Stage, soak: Soak, count: Count) -> None:
    for _ in rounds(soak):
        links, losses = stage.proxy.links, stage.losses
        stage.proxy.cut()
        stage.until(lambda losses=losses: stage.losses > losses)  # type: ignore[misc]
        began = time.monotonic()
        stage.until(lambda: stage.ring.is_available)
        stage.arrives()
        count.recoveries.append(time.monotonic() - began)
        count.rounds += 1
        assert stage.proxy.links > links
        assert count.recoveries[-1] < RECOVERS
        assert len(stage.robot.sessions) == 1  # Zenoh's own business


@pytest.mark.timeout(300)
def test_a_link_that_is_half_open_is_given_up_and_replaced(stage: Stage, soak: Soak, count: Count) -> None:
    for _ in rounds(soak):
        sessions = len(stage.robot.sessions)
        stage.proxy.conditions.is_frozen = True
        stage.until(lambda: not stage.ring.is_available)
        for _ in range(MISSES + 1):
            stage.robot.probe()
        stage.proxy.conditions.is_frozen = False
        began = time.monotonic()
        stage.until(lambda: stage.ring.is_available)
        stage.arrives()
        count.recoveries.append(time.monotonic() - began)
        count.rounds += 1
        assert count.recoveries[-1] < RECOVERS
        assert len(stage.robot.sessions) == sessions + 1
        for _ in range(2):  # the new session has proved itself: else the next one would wait for longer
            stage.robot.probe()
            stage.until(lambda: stage.robot.lifeline.result is ProbeResult.ANSWER)
