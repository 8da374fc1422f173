"""What crosses between the hosts of a robot: the topics, services and actions with ends on both sides. Pure.

Bandwidths are estimates from declared rates and from the encoded size of a message whose texts and lists are empty, so
they are lower bounds for messages with lists.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.msgs.types import Message
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Port, Qos, Serves, ServesAction
from rbxcompose.sdk.registry import component_type

OVERHEAD = 33 + 12 + 40  # [bytes] of a message: ROS 2's attachment, Zenoh's header, the header of TCP and IP


@dataclass(frozen=True, slots=True)
class End:
    """A component at one end, its host, and its port."""

    component: str
    host: str
    port: Port[Any]
    rate: float | None = None  # [Hz], as declared for the port, else that of the component's steps


@dataclass(frozen=True, slots=True)
class Crossing:
    """A topic, service or action that crosses: who gives (publishes, serves), who takes (subscribes, calls)."""

    topic: str
    type: str
    givers: tuple[End, ...]
    takers: tuple[End, ...]

    @property
    def qos(self) -> Qos | None:
        """Return the class of a topic; None for services and actions."""
        port = self.givers[0].port
        return port.qos if isinstance(port, Out) else None

    @property
    def rate(self) -> float | None:
        """Return how many messages cross per second [Hz], if this is known."""
        rates = [
            giver.rate for giver in self.givers if isinstance(giver.port, Out) and giver.port.qos is not Qos.LATCHED
        ]
        return sum(rate or 0.0 for rate in rates) if rates and all(rates) else None

    @property
    def bandwidth(self) -> float | None:
        """Return the estimated bandwidth [bit/s] to one host that takes it; None if no rate is known."""
        return self.bandwidth_at(None)

    def bandwidth_at(self, most: float | None) -> float | None:
        """Return the same if at most so many messages cross per second [Hz]."""
        interface = self.givers[0].port.interface
        if self.rate is None or interface is None:
            return None
        rate = self.rate if most is None else min(self.rate, most)
        return 8 * rate * (least_size(interface) + OVERHEAD)

    def passes(self, hosts: Collection[str]) -> bool:
        """Return whether it crosses between two of these hosts."""
        givers, takers = ({end.host for end in ends} & {*hosts} for ends in (self.givers, self.takers))
        return any(giver != taker for giver in givers for taker in takers)


FRAMES = ("/tf", "/tf_static")  # what a process subscribes to for components that look up frames
_GIVES = (Out, Serves, ServesAction)
_TAKES = (In, Calls, CallsAction)


@dataclass(frozen=True, slots=True)
class TopicEnd:
    """An end of a topic, service or action."""

    topic: str
    type: str
    end: End


def ends_of(plan: Plan, hosts: Mapping[str, str]) -> Iterator[TopicEnd]:
    """Yield all ends of components; `hosts` has the host of each."""
    for instance in plan.instances:
        for (topic, type_), end in _ends(instance, hosts[instance.name]):
            yield TopicEnd(topic, type_, end)


def crossings(plan: Plan, hosts: Mapping[str, str]) -> Iterator[Crossing]:
    """Yield all that crosses, sorted by name; `hosts` has the host of each component.

    A topic crosses if anything that takes it runs on another host than anything that gives it.
    """
    ends: dict[tuple[str, str], tuple[list[End], list[End]]] = {}
    for topic_end in ends_of(plan, hosts):
        givers, takers = ends.setdefault((topic_end.topic, topic_end.type), ([], []))
        (givers if isinstance(topic_end.end.port, _GIVES) else takers).append(topic_end.end)
    for (topic, type_), (givers, takers) in sorted(ends.items()):
        away = [taker for taker in takers if any(giver.host != taker.host for giver in givers)]
        sending = [giver for giver in givers if any(taker.host != giver.host for taker in takers)]
        if away:
            yield Crossing(topic, type_, tuple(sending), tuple(away))


def _ends(instance: Instance, host: str) -> Iterator[tuple[tuple[str, str], End]]:
    cls = component_type(instance.type)
    ports: Mapping[str, Port[Any]] = cls.ports(instance.config)
    if any(isinstance(port, Looks) for port in ports.values()):
        looks = next(port for port in ports.values() if isinstance(port, Looks))
        yield from (((topic, TFMessage.TYPE), End(instance.name, host, looks)) for topic in FRAMES)
    for wire in instance.wires:
        port = ports.get(wire.port)
        if isinstance(port, (*_GIVES, *_TAKES)) and wire.topic:
            declared = port.rate if isinstance(port, Out) else None
            yield (
                (wire.topic, wire.type),
                End(instance.name, host, port, declared or cls.rate_of(instance.config) or None),
            )


def least_size(interface: type[Message]) -> int:
    """Return the encoded size of a message with empty texts and lists [bytes]."""
    return len(encode(interface()))
