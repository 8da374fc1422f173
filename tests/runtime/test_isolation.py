"""A process that is slow to take its messages costs the others none of theirs."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Network

MESSAGES = 500


@pytest.fixture
def network() -> Iterator[Network]:
    made = Network()
    yield made
    made.close()


def test_a_topic_of_one_process_is_delivered_whole_while_another_computes(network: Network) -> None:
    source, fast, slow = network.process(), network.process(), network.process()
    received: list[float] = []
    computed: list[float] = []
    wheels = fast.bus.subscribe("wheels", "/fast", Float32, Qos.EVENT, lambda message: received.append(message.data))
    slow.bus.subscribe("planner", "/slow", Float32, Qos.STATE, lambda message: computed.append(message.data))
    to_fast = source.bus.publisher("source", "/fast", Float32, Qos.EVENT)
    to_slow = source.bus.publisher("source", "/slow", Float32, Qos.STATE)
    network.until(lambda: to_fast.has_match and to_slow.has_match)

    slow.turn = lambda: None  # type: ignore[method-assign]  # it is in a callback all the time
    for number in range(MESSAGES):
        to_slow(Float32(data=number))
        to_fast(Float32(data=number))
        source.turn()
        fast.turn()
    network.until(lambda: len(received) + wheels.dropped >= MESSAGES)
    assert wheels.dropped == 0  # its queue holds all that may come while the scheduler of a loaded machine has no turn
    assert received == list(range(MESSAGES))
    assert computed == []

    del slow.turn
    network.until(lambda: computed)
    assert len(computed) < MESSAGES  # what it could not take has made room for what is new
