"""What robots see of each other: what is shared arrives under the robot's name, and nothing else passes."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import zenoh

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.names import data_key
from rbxcompose.bus.zenoh_session import RouterLink, exchange_settings, open_exchange, open_peer, open_router
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.compiler.plan.model import BusPlan, Exchange, SharedWire
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.compiler.systems.share import exchange_of
from rbxcompose.msgs.std_msgs import Int64, String
from rbxcompose.runtime.process_group.connection import CallbackInbox
from rbxcompose.runtime.process_group.exchange import RobotExchange
from rbxcompose.sdk.ports import Qos
from tests.conftest import ROOT
from tests.systems.test_links import free_port, until

COUNT = SharedWire("/count", "/scout/count", Int64.TYPE, "event")
PLACE = SharedWire("/place", "/scout/place", String.TYPE, "latched")


class RobotWithExchange:
    """The bus of a robot: its router with an exchange, and a process with a bus."""

    def __init__(self, exchange: Exchange) -> None:
        self.clock, self.scheduler, self.inbox = MonotonicClock(), Scheduler(), CallbackInbox()
        endpoint = tcp_endpoint(free_port())
        self.router = ZenohTransport(open_router(endpoint), self.inbox.put)
        loop = self.scheduler, self.clock, self.inbox
        self.exchange = RobotExchange(exchange, BusPlan(), self.router, loop, lambda owner, text: None)
        transport = ZenohTransport(open_peer(endpoint), self.inbox.put)
        self.bus = Bus(self.scheduler, self.clock, transport=transport, log=lambda owner, text: None)

    def run(self) -> None:
        self.inbox.drain(self.scheduler)
        self.scheduler.advance(self.clock.now())

    def close(self) -> None:
        self.bus.close()
        self.exchange.close()
        self.router.close()
        self.inbox.close()


@contextmanager
def robots(*exchanges: Exchange) -> Iterator[list[RobotWithExchange]]:
    made = [RobotWithExchange(one) for one in exchanges]
    try:
        yield made
    finally:
        for exchange in made:
            exchange.close()


def test_what_is_shared_arrives_also_late_and_nothing_else_does_in_either_direction() -> None:
    endpoint = tcp_endpoint(free_port())
    gives, takes = Exchange((endpoint,), (), (COUNT, PLACE)), Exchange((), (endpoint,), (), (_taken(COUNT),))
    got: Counter[str] = Counter()

    def hear(robot: RobotWithExchange, topic: str, kind: type[String | Int64]) -> None:
        def count(message: String | Int64) -> None:
            got[f"{topic} {message.data}"] += 1

        robot.bus.subscribe("ear", topic, kind, Qos.LATCHED if kind is String else Qos.EVENT, count)

    with robots(gives, takes) as (scout, cleaner):
        place = scout.bus.publisher("mouth", "/place", String, Qos.LATCHED)
        place(String(data="dock"))
        numbers = scout.bus.publisher("mouth", "/count", Int64, Qos.EVENT)
        secret = scout.bus.publisher("mouth", "/secret", Int64, Qos.EVENT)
        forged = cleaner.bus.publisher("mouth", "/scout/count", Int64, Qos.EVENT)
        for topic in ("/scout/count", "/count", "/secret", "/scout/secret"):
            hear(cleaner, topic, Int64)
        hear(cleaner, "/scout/place", String)
        hear(scout, "/count", Int64)

        def is_there() -> bool:
            for number, publisher in ((3, secret), (2, forged), (1, numbers)):
                publisher(Int64(data=number))
            scout.run()
            cleaner.run()
            return got["/scout/count 1"] > 5

        until(is_there)
        assert {name for name in got if not name.startswith("/scout/count")} == {"/count 1"}, "its own, on its own bus"
        with robots(Exchange((), (endpoint,), (), (_taken(PLACE),))) as (late,):
            hear(late, "/scout/place", String)

            def has_arrived() -> bool:
                scout.run()
                late.run()
                return got["/scout/place dock"] > 0

            until(has_arrived)


def _taken(wire: SharedWire) -> SharedWire:
    return SharedWire(wire.shared, wire.shared, wire.type, wire.qos)


def test_whoever_dials_a_robot_can_take_what_it_shares_and_put_nothing() -> None:
    endpoint = tcp_endpoint(free_port())
    got: Counter[str] = Counter()
    with robots(Exchange((endpoint,), (), (COUNT,)), Exchange((), (endpoint,), (), (_taken(COUNT),))) as (scout, other):
        stranger = _open_to_all(endpoint)
        key = data_key(0, "/scout/count", Int64.TYPE, Int64.HASH)
        forger = stranger.declare_publisher(key)
        heard = stranger.declare_subscriber("**", lambda sample: got.update([str(sample.key_expr)]))
        numbers = scout.bus.publisher("mouth", "/count", Int64, Qos.EVENT)
        values: list[int] = []
        other.bus.subscribe("ear", "/scout/count", Int64, Qos.EVENT, lambda message: values.append(message.data))

        def is_there() -> bool:
            forger.put(b"\x00\x01\x00\x00" + (9).to_bytes(8, "little"))
            numbers(Int64(data=1))
            scout.run()
            other.run()
            return len(values) > 5

        until(is_there)
        assert set(values) == {1}
        assert set(got) <= {key}
        heard.undeclare()  # type: ignore[no-untyped-call]
        stranger.close()  # type: ignore[no-untyped-call]


def _open_to_all(endpoint: str) -> zenoh.Session:
    return open_exchange(RouterLink((), (endpoint,), access={"enabled": False}))


def test_a_port_that_is_taken_is_named_without_the_sources_of_zenoh() -> None:
    link = RouterLink(listen=(endpoint := tcp_endpoint(free_port()),))
    session = open_exchange(link)
    try:
        for taken, why in (
            (link, f"{endpoint} is taken"),
            (RouterLink(listen=("tls/127.0.0.1:1",)), "TLS private key"),
        ):
            with pytest.raises(OSError, match=re.escape(why)) as caught:
                open_exchange(taken)
            assert ".rs:" not in str(caught.value)
    finally:
        session.close()  # type: ignore[no-untyped-call]


def test_a_session_of_an_exchange_looks_for_nobody() -> None:
    settings = exchange_settings(RouterLink())
    assert settings["scouting/multicast/enabled"] is False
    assert settings["scouting/gossip/enabled"] is False


SYSTEM = """
rbx: 1
kind: System
name: fleet
hosts: {one: {address: 10.0.0.1, labels: [floor]}, two: {address: 10.0.0.2, labels: [floor]}, desk: {}}
robots:
  scout: {robot: ROOT/robots/turtlebot/robot.yaml, instances: 3, on: floor, share: [odom]}
  watcher: {robot: watcher.yaml, on: desk}
"""
WATCHER = """
rbx: 1
kind: Robot
name: watcher
components:
  seen: {type: topic_monitor, topic: /scout_2/odom, message: nav_msgs/Odometry, rate: 1}
"""


def test_instances_take_hosts_of_a_label_in_turn_and_only_what_somebody_takes_is_offered(tmp_path: Path) -> None:
    (tmp_path / "watcher.yaml").write_text(WATCHER, encoding="utf-8")
    (tmp_path / "system.yaml").write_text(SYSTEM.replace("ROOT", str(ROOT)), encoding="utf-8")
    system = compile_system(str(tmp_path / "system.yaml"), environment={})
    assert not system.report.has_errors
    scouts = {name: set(robot.hosts.values()) for name, robot in system.robots.items() if name != "watcher"}
    assert scouts == {"scout_1": {"one"}, "scout_2": {"two"}, "scout_3": {"one"}}
    assert len({robot.plan.bus.port for robot in system.robots.values()}) == 4, "each router has a port of its own"
    given = exchange_of(system, system.robots["scout_2"], "two")
    taken = exchange_of(system, system.robots["watcher"], "desk")
    assert given is not None
    assert taken is not None
    assert given.listen == taken.connect == ("tcp/10.0.0.2:8448",)
    assert [wire.shared for wire in given.gives] == [wire.own for wire in taken.takes] == ["/scout_2/odom"]
    assert exchange_of(system, system.robots["scout_1"], "one") is None
