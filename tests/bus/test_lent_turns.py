"""A process that rests lends its turn to Zenoh's thread, which sends what cannot wait, and leaves the rest to it."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.msgs.std_msgs import Bool
from rbxcompose.runtime.process_group.connection import CallbackInbox, Turns
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Network


class Lender:
    """A process whose own thread is that of the test."""

    def __init__(self, port: int) -> None:
        self.clock, self.scheduler, self.inbox = MonotonicClock(), Scheduler(), CallbackInbox()
        self.turns = Turns(self.scheduler, self.clock, self.inbox)
        self.transport = ZenohTransport(open_peer(f"tcp/127.0.0.1:{port}"), self.inbox.put, self.turns)
        self.bus = Bus(self.scheduler, self.clock, transport=self.transport, log=lambda owner, text: None)
        self.turns.open()

    def turn(self) -> None:
        self.inbox.drain(self.scheduler)
        self.scheduler.advance(self.clock.now())


@pytest.fixture
def lender(network: Network) -> Iterator[Lender]:
    made = Lender(network.port)
    yield made
    made.bus.close()
    made.inbox.close()


def test_a_message_is_handled_where_it_arrives_and_answered_without_its_own_thread(
    network: Network, lender: Lender
) -> None:
    other = network.process()
    threads: list[int] = []
    back: list[bool] = []
    pong = lender.bus.publisher("echo", "pong", Bool, Qos.COMMAND)

    def answer(message: Bool) -> None:
        threads.append(threading.get_ident())
        pong(message)

    lender.bus.subscribe("echo", "ping", Bool, Qos.COMMAND, answer)
    other.bus.subscribe("asker", "pong", Bool, Qos.COMMAND, lambda message: back.append(message.data))
    ping = other.bus.publisher("asker", "ping", Bool, Qos.COMMAND)
    network.until(lambda: ping.has_match and pong.has_match)
    lender.turn()
    lender.turns.rest(lender.clock.now() + 60.0)
    ping(Bool(data=True))
    network.until(lambda: back)
    lender.turns.resume()
    assert threads[0] != threading.get_ident()
    assert not lender.inbox.has_some


@pytest.mark.parametrize("qos", [Qos.LATCHED, Qos.BULK])
def test_latched_and_bulk_messages_wait_for_the_own_thread(network: Network, lender: Lender, qos: Qos) -> None:
    other = network.process()
    threads: list[int] = []
    lender.bus.subscribe("sink", "ping", Bool, qos, lambda message: threads.append(threading.get_ident()))
    ping = other.bus.publisher("asker", "ping", Bool, qos)
    network.until(lambda: ping.has_match)
    lender.turn()
    lender.turns.rest(lender.clock.now() + 60.0)
    ping(Bool(data=True))
    network.until(lambda: lender.inbox.has_some)
    lender.turns.resume()
    lender.turn()
    assert threads == [threading.get_ident()]


def test_what_may_wait_for_the_link_or_declares_is_left_to_the_own_thread(network: Network, lender: Lender) -> None:
    other = network.process()
    events: list[bool] = []
    declared: list[bool] = []
    event = lender.bus.publisher("relay", "event", Bool, Qos.EVENT)

    def relay(message: Bool) -> None:
        event(message)
        late = lender.bus.publisher("relay", "late", Bool, Qos.COMMAND)
        late(message)
        lender.bus.subscribe("relay", "more", Bool, Qos.COMMAND, lambda one: declared.append(one.data))

    lender.bus.subscribe("relay", "ping", Bool, Qos.COMMAND, relay)
    other.bus.subscribe("asker", "event", Bool, Qos.EVENT, lambda message: events.append(message.data))
    ping = other.bus.publisher("asker", "ping", Bool, Qos.COMMAND)
    more = other.bus.publisher("asker", "more", Bool, Qos.COMMAND)
    network.until(lambda: ping.has_match and event.has_match)
    lender.turn()
    lender.turns.rest(lender.clock.now() + 60.0)
    ping(Bool(data=True))
    network.until(lambda: lender.inbox.has_some)
    assert not events
    assert not more.has_match
    lender.turns.resume()
    lender.turn()
    network.until(lambda: events and more.has_match)
    more(Bool(data=True))
    network.until(lambda: lender.inbox.has_some)
    lender.turn()
    assert declared == [True]
