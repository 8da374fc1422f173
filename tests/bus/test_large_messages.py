"""Large messages, in pieces or through shared memory."""

from __future__ import annotations

import time

import pytest

from rbxcompose.msgs.std_msgs import String
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Connected, Network


@pytest.mark.parametrize("size", [60_000, 1_000_000])
def test_large_messages_arrive_whole(network: Network, one: Connected, other: Connected, size: int) -> None:
    got: list[String] = []
    other.bus.subscribe("viewer", "image", String, Qos.BULK, got.append)
    publish = one.bus.publisher("camera", "image", String, Qos.BULK)
    network.until(lambda: publish._remote.has_match)
    sent, due = String(data="x" * size), 0.0

    def is_there() -> bool:
        nonlocal due
        if time.monotonic() > due:  # again: what is large is dropped if the machine stands still for a moment
            publish(sent)
            due = time.monotonic() + 0.5
        return bool(got)

    network.until(is_there)
    assert got[0] == sent
