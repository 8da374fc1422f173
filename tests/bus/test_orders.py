"""Orders: who sends them knows whether those who carry them out listen, in this process and in others."""

from __future__ import annotations

from rbxcompose.bus.topics import OrderPublisher
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Alone, Connected, Network, network

__all__ = ["network"]


def orders(process: Alone | Connected) -> OrderPublisher[Float32]:
    return process.bus.orders("mission", "grip", Float32, Qos.EVENT, ("gripper",))


def listen(process: Alone | Connected, owner: str = "gripper", *, waits: bool = False) -> list[float]:
    got: list[float] = []
    process.bus.subscribe(owner, "grip", Float32, Qos.EVENT, lambda order: got.append(order.data), waits=waits)
    return got


def test_only_who_carries_orders_out_counts(alone: Alone) -> None:
    send = orders(alone)
    listen(alone, "recorder")
    assert not send.listeners
    listen(alone)
    assert len(send.listeners) == 1


def test_each_life_of_a_listener_has_a_name_and_changes_are_told(alone: Alone) -> None:
    send, changes = orders(alone), []
    send.watch(lambda: changes.append(send.listeners))
    listen(alone)
    alone.settle()
    first = send.listeners
    alone.bus.close_owner("gripper")
    alone.settle()
    listen(alone)
    alone.settle()
    assert changes == [first, frozenset(), send.listeners]
    assert not first & send.listeners


def test_orders_wait_until_the_component_is_open(alone: Alone) -> None:
    send, got = orders(alone), listen(alone, waits=True)
    send(Float32(data=1.0))
    send(Float32(data=2.0))
    alone.settle()
    assert got == []
    alone.bus.open("gripper")
    alone.settle()
    send(Float32(data=3.0))
    alone.settle()
    assert got == [1.0, 2.0, 3.0]


def test_a_listener_of_another_process_is_found_gets_the_first_order_and_is_missed(network: Network) -> None:
    here, there = network.process(), network.process()
    send = orders(here)
    listen(there, "recorder")
    got = listen(there)
    network.until(lambda: send.listeners)
    assert len(send.listeners) == 1
    send(Float32(data=1.0))
    network.until(lambda: got)
    assert got == [1.0]
    there.bus.close_owner("gripper")
    network.until(lambda: not send.listeners)
