from __future__ import annotations

import threading

from rbxcompose.bus.names import Attachment
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Network


class Known(threading.local):
    calls = 0


def test_a_thread_of_zenoh_is_known_to_python_from_its_first_call_on(network: Network) -> None:
    one, other = network.process(), network.process()
    known, seen = Known(), list[int]()

    def arrived(arrival: object) -> None:
        known.calls += 1
        seen.append(known.calls)

    other.transport.subscribe("0/topic/type/hash", Qos.EVENT, arrived)
    publisher = one.transport.publisher("0/topic/type/hash", Qos.EVENT)
    network.until(lambda: publisher.has_match)
    for _ in range(50):
        publisher.put(b"", Attachment(1, 0, bytes(16)).encode())
    network.until(lambda: len(seen) == 50)
    assert max(seen) > 1  # else what belongs to the thread would be gone after each call
