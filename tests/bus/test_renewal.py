"""What was declared is declared again on another transport; what is lost with the first one is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from rbxcompose.bus.renewal import RENEWED, RenewableTransport
from rbxcompose.bus.transport import LONGEST_WAIT, Arrival, Closable, OnReply, Question, TransportReply
from rbxcompose.sdk.ports import Qos


@dataclass(eq=False)
class Link:
    """A transport that writes down what it is told to do."""

    session: str
    done: list[str] = field(default_factory=list)
    changed: Callable[[str, bool], None] = lambda token, is_there: None

    def wake(self, owner: str, callback: Callable[[], None]) -> None:
        callback()

    bring = wake

    def publisher(self, key: str, qos: Qos) -> End:
        return self._declare(f"publish {key}")

    def subscribe(self, key: str, qos: Qos, arrived: Callable[[Arrival], None]) -> Closable:
        return self._declare(f"subscribe {key}")

    def serve(self, key: str, asked: Callable[[Question], None]) -> Closable:
        return self._declare(f"serve {key}")

    def ask(
        self, key: str, payload: bytes, attachment: bytes, answered: OnReply, *, of_all: bool, within: float
    ) -> Closable:
        return self._declare(f"ask {key}")

    def announce(self, token: str) -> Closable:
        return self._declare(f"announce {token}")

    def watch(self, pattern: str, changed: Callable[[str, bool], None]) -> Closable:
        self.changed = changed
        return self._declare(f"watch {pattern}")

    def close(self) -> None:
        self.done.append("closed")

    def _declare(self, what: str) -> End:
        self.done.append(what)
        return End(self, what)


@dataclass(frozen=True)
class End:
    """Something that was declared."""

    link: Link
    what: str
    has_match = True

    def put(self, payload: bytes, attachment: bytes) -> None:
        self.link.done.append(f"put {payload.decode()}")

    def close(self) -> None:
        self.link.done.append(f"withdraw {self.what}")


@pytest.fixture
def links() -> tuple[Link, Link, RenewableTransport]:
    first, second = Link("1"), Link("2")
    return first, second, RenewableTransport(first)


Links = tuple[Link, Link, RenewableTransport]


def test_all_that_lives_is_declared_again_in_its_order_and_nothing_else(links: Links) -> None:
    first, second, transport = links
    gone = transport.subscribe("gone", Qos.STATE, lambda arrival: None)
    transport.serve("service", lambda question: None)
    transport.announce("token")
    gone.close()
    assert transport.detach() is first
    transport.subscribe("late", Qos.STATE, lambda arrival: None)
    transport.attach(second)
    assert first.done[-1] == "withdraw subscribe gone"
    assert second.done == ["serve service", "announce token", "subscribe late"]


def test_the_session_keeps_the_name_by_which_the_others_know_the_process(links: Links) -> None:
    _, second, transport = links
    transport.detach()
    transport.attach(second)
    assert transport.session == "1"


def test_a_latched_message_is_there_again_and_others_are_dropped_in_between(links: Links) -> None:
    _, second, transport = links
    map_, speed = transport.publisher("map", Qos.LATCHED), transport.publisher("speed", Qos.COMMAND)
    transport.detach()
    map_.put(b"house", b"")
    speed.put(b"fast", b"")
    assert (map_.has_match, speed.has_match) == (True, False)
    transport.attach(second)
    speed.put(b"slow", b"")
    assert second.done == ["publish map", "put house", "publish speed", "put slow"]


def test_a_request_is_never_sent_twice_and_ends_with_an_error(links: Links) -> None:
    first, second, transport = links
    answers: list[TransportReply] = []
    transport.ask("before", b"", b"", answers.append, of_all=True, within=LONGEST_WAIT)
    transport.detach()
    transport.ask("between", b"", b"", answers.append, of_all=True, within=LONGEST_WAIT)
    transport.attach(second)
    assert answers == [TransportReply(error=RENEWED)] * 2
    assert (first.done, second.done) == (["ask before"], [])


def test_who_was_known_is_gone_until_the_new_session_finds_it(links: Links) -> None:
    first, second, transport = links
    heard: list[tuple[str, bool]] = []
    transport.watch("*", lambda token, is_there: heard.append((token, is_there)))
    first.changed("a", True)
    first.changed("b", True)
    first.changed("b", False)
    transport.detach()
    first.changed("a", False)  # late news
    transport.attach(second)
    second.changed("a", True)
    assert heard == [("a", True), ("b", True), ("b", False), ("a", False), ("a", True)]


def test_a_transport_that_comes_after_the_end_is_closed(links: Links) -> None:
    _, second, transport = links
    transport.detach()
    transport.close()
    transport.attach(second)
    assert second.done == ["closed"]
