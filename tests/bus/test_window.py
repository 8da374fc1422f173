"""Windows between processes: news for who listens, the whole for who asks, and nothing for nobody."""

from __future__ import annotations

import json
from typing import Any

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.bus.names import admin_key
from rbxcompose.bus.services import GRACE, Window
from rbxcompose.bus.transport import LONGEST_WAIT, TransportReply
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Alone, Connected, Network

KEY = admin_key("bot", "missions/patrol")


def asked(network: Network, by: Connected) -> TransportReply:
    """Return the first that comes back."""
    found: list[TransportReply] = []
    network.until(lambda: _ask(by, found))
    return found[0]


def _ask(by: Connected, found: list[TransportReply]) -> bool:
    """Ask again until the server answers: it may not be known yet."""
    if not found or found[0].error == "the server is gone":
        found.clear()
        by.transport.ask(KEY, b"", b"", found.append, of_all=True, within=LONGEST_WAIT)
        by.turn()
    return bool(found) and found[0].error != "the server is gone"


def is_watched(window: Window) -> bool:
    """Tell it now: for the type checker it would stay as it was."""
    return window.is_watched


def value_of(payload: bytes) -> tuple[int, Any]:
    message = json.loads(payload)
    return message["sequence"], message["value"]


def test_who_asks_gets_the_whole_and_who_listens_the_news(network: Network) -> None:
    one, other = network.process(), network.process()
    window = one.bus.window("mission", KEY, lambda: {"all": 1})
    assert not is_watched(window)
    heard: list[bytes] = []
    listening = other.transport.subscribe(
        admin_key("bot", "missions/*"), Qos.STATE, lambda sample: heard.append(sample.payload)
    )
    network.until(lambda: window._remote.has_match)
    assert is_watched(window)
    window.put({"news": 1})
    window.put({"news": 2})
    network.until(lambda: len(heard) == 2)
    assert [value_of(data) for data in heard] == [(1, {"news": 1}), (2, {"news": 2})]
    assert value_of(asked(network, other).payload) == (2, {"all": 1})
    listening.close()
    network.until(lambda: not window._remote.has_match)
    one.bus.close_owner("mission")
    other.transport.ask(
        KEY, b"", b"", lambda answer: heard.append(answer.error.encode()), of_all=True, within=LONGEST_WAIT
    )
    network.until(lambda: heard[-1] == b"the server is gone")


def test_a_refusal_reaches_who_asks(network: Network) -> None:
    one, other = network.process(), network.process()

    def refuse() -> str:
        raise Refused("it has not been running")

    one.bus.window("mission", KEY, refuse)
    assert asked(network, other).error == "it has not been running"


class Asking:
    """A question in one process."""

    payload = attachment = b""
    answer: Any = None

    def reply(self, payload: bytes, attachment: bytes, reason: str = "") -> None:
        self.answer = json.loads(payload)

    def fail(self, error: str) -> None:
        self.answer = error


def test_who_asks_counts_as_listening_until_the_transport_knows(alone: Alone) -> None:
    window = alone.bus.window("mission", KEY, lambda: {})
    assert not is_watched(window)
    window._asked(Asking())
    assert is_watched(window)
    alone.settle(GRACE + 0.1)
    assert not is_watched(window)


def test_an_answer_that_raises_is_an_error_for_both_sides(alone: Alone) -> None:
    def broken() -> str:
        raise ZeroDivisionError("no such thing")

    window: Window = alone.bus.window("mission", KEY, broken)
    question = Asking()
    with pytest.raises(ZeroDivisionError):
        window._asked(question)
    assert question.answer == "ZeroDivisionError: no such thing"
