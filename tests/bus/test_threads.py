from __future__ import annotations

import threading

import pytest

from rbxcompose.bus.names import Attachment
from rbxcompose.bus.transport import RemotePublisher
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


@pytest.mark.timeout(9)  # [s]; Zenoh gives up after 10
def test_a_latched_publisher_leaves_while_all_receiving_threads_wait_for_python(network: Network) -> None:
    other, senders = network.process(), [network.process() for _ in range(4)]
    is_over = threading.Event()
    other.transport.subscribe("0/topic/type/hash", Qos.STATE, lambda arrival: None)

    def send(publisher: RemotePublisher) -> None:
        while not is_over.is_set():
            publisher.put(b"", Attachment(1, 0, bytes(16)).encode())

    publishers = [sender.transport.publisher("0/topic/type/hash", Qos.STATE) for sender in senders]
    threads = [threading.Thread(target=send, args=(publisher,)) for publisher in publishers]
    for thread in threads:
        thread.start()
    try:
        for _ in range(100):
            publisher = other.transport.publisher("0/latched/type/hash", Qos.LATCHED)
            publisher.put(b"", Attachment(1, 0, bytes(16)).encode())
            publisher.close()
    finally:
        is_over.set()
        for thread in threads:
            thread.join()
