"""Whether anybody would receive a message, which may then be left unmade."""

from __future__ import annotations

from rbxcompose.msgs.std_msgs import String
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Network


def test_a_message_is_wanted_while_somebody_listens_here_or_elsewhere(network: Network) -> None:
    one, other = network.process(), network.process()
    publish = one.bus.publisher("talker", "chatter", String, Qos.STATE)

    def is_wanted() -> bool:
        return publish.is_wanted

    assert not is_wanted()
    other.bus.subscribe("there", "chatter", String, Qos.STATE, lambda message: None)
    network.until(is_wanted)
    other.bus.close_owner("there")
    network.until(lambda: not is_wanted())
    one.bus.subscribe("here", "chatter", String, Qos.STATE, lambda message: None)
    assert is_wanted()


def test_a_latched_message_is_always_wanted(network: Network) -> None:
    assert network.process().bus.publisher("talker", "map", String, Qos.LATCHED).is_wanted
