"""What diagnostics tell of messages that are not taken, and of publishers that are not heard."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.base.levels import Level
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.graph import SILENCE
from rbxcompose.bus.names import Attachment, dds_type
from rbxcompose.bus.tokens import EntityKind, NodeToken
from rbxcompose.bus.transport import Arrival, NoTransport
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.runtime.process_group.host import PERIOD, Deliveries
from rbxcompose.runtime.process_group.provided import Statuses
from rbxcompose.sdk.ports import Qos

GOOD = encode(Float32(data=0.5))


class Bytes:
    """Something that came from another process."""

    def __init__(self, payload: bytes) -> None:
        self.payload, self.attachment = payload, Attachment(1, 0, bytes(16)).encode()


class Wire(NoTransport):
    """A transport whose other end is the test."""

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        self.arrived: Callable[[Arrival], None]
        self.changed: Callable[[str, bool], None]

    def wake(self, owner: str, callback: Callable[[], None]) -> None:
        self._scheduler.post(owner, callback)

    bring = wake

    def subscribe(self, key: str, qos: Qos, arrived: Callable[[Arrival], None]) -> NoTransport:
        self.arrived = arrived
        return self

    def watch(self, pattern: str, changed: Callable[[str, bool], None]) -> NoTransport:
        self.changed = changed
        return self


class Process:
    """A process that listens to a level, and what it tells of that."""

    def __init__(self, *, is_restart: bool = False) -> None:
        self.scheduler, self.clock = Scheduler(), SteppedClock()
        self.wire = Wire(self.scheduler)
        self.bus = bus = Bus(self.scheduler, self.clock, transport=self.wire, log=lambda owner, text: None)
        statuses = Statuses("host", bus, self.scheduler, self.clock)
        deliveries = Deliveries("host", bus, self.scheduler, self.clock, statuses)
        bus.subscribe("tools", "/diagnostics", DiagnosticArray, Qos.STATE, self._note)
        bus.subscribe("charger", "level", Float32, Qos.STATE, lambda message: None)
        self.told: list[tuple[str, Level, str]] = []
        deliveries.start(is_restart=is_restart)

    def _note(self, message: DiagnosticArray) -> None:
        self.told += [(status.name, Level(status.level), status.message) for status in message.status]

    def advance(self, seconds: float) -> None:
        self.scheduler.advance(self.clock.now())
        end = self.clock.now() + seconds
        while self.clock.now() < end:
            due = self.scheduler.next_due()
            self.clock.advance_to(end if due is None else max(self.clock.now(), min(end, due)))
            self.scheduler.advance(self.clock.now())


@pytest.fixture
def process() -> Process:
    return Process()


def token(type_hash: str = Float32.HASH) -> str:
    node = NodeToken(0, "elsewhere", 1, "battery")
    return node.endpoint_key(EntityKind.PUBLISHER, 2, "/level", dds_type(Float32.TYPE), type_hash, "::,10:,:,:,,")


def test_refused_messages_are_counted_once_a_second_and_forgiven_when_no_more_come(process: Process) -> None:
    for _ in range(3):
        process.wire.arrived(Bytes(GOOD[:-1]))
    process.advance(PERIOD)
    process.advance(PERIOD)
    assert process.told[0] == ("charger: level", Level.WARN, "3 messages were refused on /level: wrong length")
    assert process.told[-1] == ("charger: level", Level.OK, "messages arrive as they should")


def test_a_restarted_process_takes_back_what_the_one_before_complained_of() -> None:
    process = Process(is_restart=True)
    process.advance(2 * PERIOD)
    assert ("charger: level", Level.OK, "messages arrive as they should") in process.told


def test_a_silent_publisher_is_told_until_it_speaks(process: Process) -> None:
    process.wire.changed(token(), True)
    process.advance(SILENCE)
    assert process.told == []
    process.advance(2 * PERIOD)
    name, level, text = process.told[-1]
    assert (name, level) == ("charger: level", Level.WARN)
    assert text.startswith("'charger' has received nothing on /level for ")
    assert text.endswith(" s, though 'battery' publishes it")
    process.wire.arrived(Bytes(GOOD))
    process.advance(2 * PERIOD)
    assert process.told[-1][1] is Level.OK


def test_the_parts_of_an_action_may_be_silent(process: Process) -> None:
    waiting = ("charge/_action/feedback", "charge/_action/status")
    subscriptions = [process.bus.subscribe("mission", name, Float32, Qos.STATE, print) for name in waiting]
    assert not any(subscription.reader.expects_speech for subscription in subscriptions)
    assert process.bus.subscribe("mission", "charge", Float32, Qos.STATE, print).reader.expects_speech


def test_a_publisher_of_another_version_is_told_within_a_second(process: Process) -> None:
    process.wire.changed(token("RIHS01_0"), True)
    process.advance(PERIOD)
    text = "'battery' publishes another version of std_msgs/msg/Float32 on /level than 'charger' reads"
    assert process.told == [("charger: level", Level.WARN, text)]
    process.wire.changed(token("RIHS01_0"), False)
    process.advance(2 * PERIOD)
    assert process.told[-1][1] is Level.OK
