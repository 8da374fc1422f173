"""A system after reading: its hosts, its robots with the host of each component and why, and what crosses. Pure.

Bandwidths are estimates from declared rates and from the encoded size of a message whose texts and lists are empty, so
they are lower bounds for messages with lists.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import field
from functools import cached_property
from pathlib import Path
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import NeededFile, Report, Span
from rbxcompose.bus.names import TRANSFORMS
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.manifest.system_file import HostModel, LinkModel, SystemRobotModel
from rbxcompose.manifest.tree import MappingNode, value_span
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
        for (topic, type_), end in _ends(plan, instance, hosts[instance.name]):
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


def _ends(plan: Plan, instance: Instance, host: str) -> Iterator[tuple[tuple[str, str], End]]:
    ports = plan.ports(instance)
    if any(isinstance(port, Looks) for port in ports.values()):
        looks = next(port for port in ports.values() if isinstance(port, Looks))
        yield from (((topic, TFMessage.TYPE), End(instance.name, host, looks)) for topic in TRANSFORMS)
    for wire in instance.wires:
        port = ports.get(wire.port)
        if isinstance(port, (*_GIVES, *_TAKES)) and wire.topic:
            declared = port.rate if isinstance(port, Out) else None
            rate = declared or component_type(instance.type).rate_of(instance.config) or None
            yield (wire.topic, wire.type), End(instance.name, host, port, rate)


def least_size(interface: type[Message]) -> int:
    """Return the encoded size of a message with empty texts and lists [bytes]."""
    return len(encode(interface()))


PORTS = 65536


@dataclass(frozen=True, slots=True)
class HostOffer:
    """What placement knows of a host."""

    labels: frozenset[str] = frozenset()
    devices: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Wishes:
    """What a robot wants: `on` is a host or a label for all, `place` for a component or a part by its name."""

    on: str | None = None
    place: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Placement:
    """A component on a host, and why in words."""

    component: str
    host: str
    reason: str


def hosts_called(name: str, hosts: Mapping[str, HostOffer]) -> list[str]:
    """Return the host of this name, else all that have it as a label."""
    return [name] if name in hosts else [host for host, facts in hosts.items() if name in facts.labels]


def place(
    components: Iterable[str],
    hosts: Mapping[str, HostOffer],
    wishes: Wishes,
    parts: Mapping[str, Collection[str]],
    devices: Mapping[str, Collection[str]],
) -> dict[str, Placement]:
    """Place each component on exactly one host; there is at least one, and each wish names one.

    A wish for the component itself counts most, then that for the smallest part with it, then the host that its
    devices are connected to, then `on`: of hosts with that label, the one with most of the robot. `parts` are the
    components of each part, `devices` those that each opens.
    """
    found: dict[str, Placement] = {}
    open_ = list(components)
    for name in open_:
        if wanted := _wish_of(name, wishes.place, parts):
            key, called = wanted
            found[name] = _chosen(name, called, hosts, found, "placed there" if key == name else f"of part '{key}'")
    for name in open_:
        if name not in found and (there := _hosts_with(devices.get(name, ()), hosts)):
            found[name] = Placement(name, there[0], f"has {' and '.join(sorted(devices[name]))}")
    if wishes.on is not None:
        by_label = "" if wishes.on in hosts else f", by label '{wishes.on}'"
        main, why = _main_host(hosts_called(wishes.on, hosts), found), f"the robot's host{by_label}"
    else:
        main, why = _main_host(hosts, found), "the only host" if len(hosts) == 1 else "has most of the robot"
    for name in open_:
        if name not in found:
            found[name] = Placement(name, main, why)
    return {name: found[name] for name in open_}


def _wish_of(name: str, wishes: Mapping[str, str], parts: Mapping[str, Collection[str]]) -> tuple[str, str] | None:
    """Return the key of the wish that counts for a component, and what it calls."""
    if name in wishes:
        return name, wishes[name]
    around = [part for part in wishes if name in parts.get(part, ())]
    return min(((part, wishes[part]) for part in around), key=lambda pair: (len(parts[pair[0]]), pair), default=None)


def _chosen(
    name: str, called: str, hosts: Mapping[str, HostOffer], found: Mapping[str, Placement], reason: str
) -> Placement:
    """Return the place on the host of this name; of several with this label, on the one that has least to run."""
    candidates = hosts_called(called, hosts)
    if called in hosts:
        return Placement(name, called, reason)
    load = Counter(placement.host for placement in found.values())
    host = min(candidates, key=lambda candidate: load[candidate])  # the first one, if several are equal
    return Placement(name, host, f"{reason}, by label '{called}'")


def _hosts_with(devices: Collection[str], hosts: Mapping[str, HostOffer]) -> list[str]:
    """Return the hosts that all these devices are connected to; none if there are no devices."""
    return [name for name, facts in hosts.items() if devices and facts.devices.issuperset(devices)]


def _main_host(hosts: Iterable[str], found: Mapping[str, Placement]) -> str:
    load = Counter(placement.host for placement in found.values())
    return max(hosts, key=lambda name: load[name])


@dataclass(frozen=True, eq=False)
class PlacedRobot:
    """A robot of a system: its plan as if it ran on one host, and where each component runs."""

    name: str
    entry: str  # its key in the system's file; of several instances, the same
    model: SystemRobotModel
    robot: Robot
    plan: Plan
    placed: Mapping[str, Placement]
    link_port: int
    share_port: int
    version: str  # of rbxcompose and the texts that it was compiled from

    @cached_property
    def hosts(self) -> Mapping[str, str]:
        """Return the host of each component."""
        return {name: placement.host for name, placement in self.placed.items()}

    @cached_property
    def crossings(self) -> tuple[Crossing, ...]:
        """Return what crosses between its hosts."""
        return tuple(crossings(self.plan, self.hosts))

    @cached_property
    def ends(self) -> tuple[TopicEnd, ...]:
        """Return all ends of its components."""
        return tuple(ends_of(self.plan, self.hosts))

    @property
    def labels(self) -> frozenset[str]:
        """Return what it may be called by, with others."""
        return labels_of(self.name, self.entry, self.model)

    def span(self, root: MappingNode, *keys: str | int) -> Span:
        """Return the place of a value of its entry in the system's file."""
        return value_span(root, ("robots", self.entry, *keys))


def labels_of(name: str, entry: str, model: SystemRobotModel) -> frozenset[str]:
    """Return what a robot may be called by, with others: its name, that of its instances, and its labels."""
    return frozenset({name, entry, *model.labels})


@dataclass(slots=True)
class System:
    """The result of compiling a system; with errors in the report, robots may be missing."""

    path: Path | None = None
    name: str = ""
    root: MappingNode = field(default_factory=MappingNode)
    security: str = "none"
    hosts: Mapping[str, HostModel] = field(default_factory=dict)
    links: Mapping[str, LinkModel] = field(default_factory=dict)
    labels: Mapping[str, frozenset[str]] = field(default_factory=dict)  # of each robot, also of one with errors
    robots: dict[str, PlacedRobot] = field(default_factory=dict)
    report: Report = field(default_factory=Report)
    sources: dict[str, str] = field(default_factory=dict)
    needed: frozenset[NeededFile] = frozenset()  # beside these texts
    profiles: tuple[str, ...] = ()  # those that were chosen
    known_profiles: tuple[str, ...] = ()


def next_port(first: int, taken: Collection[int]) -> int:
    """Return a port that no robot has; two robots of a host would else try one after the other."""
    ports: Iterable[int] = (*range(first, PORTS), *range(1024, first))
    return next(port for port in ports if port not in taken)
