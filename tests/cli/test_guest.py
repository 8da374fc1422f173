"""A visitor on a bus with many others."""

from __future__ import annotations

import argparse
import selectors
import signal
from contextlib import ExitStack
from types import SimpleNamespace
from typing import Any

import pytest

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.graph import GraphEnd, GraphName, WireType
from rbxcompose.bus.zenoh_session import open_router
from rbxcompose.commands import messages
from rbxcompose.commands.console import ENDINGS
from rbxcompose.commands.guest import Guest, ReceivedMessage
from rbxcompose.commands.lookup import BusPlace
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.std_msgs import Bool
from rbxcompose.runtime.process_group.connection import CallbackInbox
from tests.programs.test_child import eventually
from tests.systems.test_links import free_port

MANY = 1000  # tokens, more than Zenoh's channels take


class Alone(Guest):
    """A guest with a loop but no session; the server of its only action takes each goal, and never ends it."""

    def __init__(self) -> None:
        self.clock, self.scheduler, self.is_interrupted = MonotonicClock(), Scheduler(), False
        self._inbox, self._selector, self._bus = CallbackInbox(), selectors.SelectSelector(), None
        self.transport: Any = SimpleNamespace(close=lambda: None)
        self._selector.register(self._inbox, selectors.EVENT_READ, lambda: None)
        self.cancels = 0

    def graph(self) -> Any:
        return SimpleNamespace(actions=(), topics=())

    def bus(self, kind: object = None) -> Any:
        return SimpleNamespace(action_client=lambda owner, name, action: self)

    is_available = True

    def __call__(self, *_: object) -> Alone:
        self.scheduler.post("", lambda: signal.raise_signal(signal.SIGTERM))
        return self

    def cancel(self) -> None:
        self.cancels += 1


def test_a_goal_that_does_not_end_when_it_is_cancelled_is_left_after_the_timeout(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(messages, "wanted", lambda *_: SimpleNamespace(name="/say", kinds=[None]))
    monkeypatch.setattr(messages, "type_of", lambda *_: registry.action("rbxcompose_msgs/action/Say"))
    with Alone() as guest:
        assert messages.send(guest, argparse.Namespace(name="/say", content="", timeout=0.01, json=False)) == 1
    assert guest.cancels == 1
    assert "'/say': the goal has not ended within 0.01 s of the request to cancel it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("givers", "comes_at", "notices"), [("/base", 9, 1), ("/base", 2, 0), ("", 9, 0)], ids=["silent", "in time", "open"]
)
def test_an_echo_says_once_that_nothing_comes_of_a_publisher(
    givers: str, comes_at: int, notices: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    kind = WireType(Bool.TYPE, Bool.HASH)
    topic = GraphName("/on", tuple(GraphEnd(node, kind, b"", None) for node in givers.split()), ())
    monkeypatch.setattr(GraphName, "kinds", [kind])
    monkeypatch.setattr(messages, "wanted", lambda *_: topic)
    arrival: Any = SimpleNamespace(payload=encode(Bool(data=True)), attachment=b"")
    listeners: list[Any] = []
    periods = iter(range(1, 12))
    with Alone() as guest:

        def run(until: Any, timeout: float) -> bool:
            if next(periods) >= comes_at:
                listeners[0](ReceivedMessage(0.0, kind, arrival))
            return bool(until())

        monkeypatch.setattr(guest, "run", run)
        monkeypatch.setattr(guest, "listen", lambda topic, receive: listeners.append(receive))
        guest._queues = []
        assert messages.echo(guest, argparse.Namespace(topic="/on", count=2, json=False)) == 0
    words = "warning[RBX9053]: '/on' has a publisher, but no message of it has come"
    shown = capsys.readouterr()
    assert (shown.err.count(words), shown.out.count("data: true")) == (notices, 2)


@pytest.mark.parametrize("first", ENDINGS)
def test_after_an_interrupt_each_signal_does_what_it_did_before(first: signal.Signals) -> None:
    before = [signal.getsignal(number) for number in ENDINGS]
    with Alone() as guest, guest.interruptible():
        signal.raise_signal(first)
        assert guest.is_interrupted
        assert [signal.getsignal(number) for number in ENDINGS] == before


@pytest.mark.parametrize("stays", [False, True])
def test_tokens_that_arrive_while_it_asks_for_them_do_not_hold_it_up(stays: bool) -> None:
    with ExitStack() as stack:
        router = stack.enter_context(open_router(at := tcp_endpoint(free_port())))
        kept = [router.liveliness().declare_token(f"crowd/{number}") for number in range(MANY)]
        guest = stack.enter_context(Guest(BusPlace(at, 0), stays=stays))
        seen: set[str] = set()
        guest.transport.watch("crowd/**", lambda token, is_there: seen.add(token))
        eventually(lambda: bool(seen))  # and not all of them yet
        eventually(lambda: len(guest.tokens("crowd/**")) == len(kept))
