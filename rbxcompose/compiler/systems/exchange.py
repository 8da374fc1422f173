"""What robots of a system let each other see and call, under the name of the robot, and nothing else. Pure.

The host of who publishes or serves it offers it at a port of its own. The host of each component of another robot that
takes it fetches it from there, and gives it to the bus of its robot.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, TypeVar

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.compiler.model.robot import resolve
from rbxcompose.compiler.plan.model import Exchange, HostAccess, SharedWire
from rbxcompose.compiler.systems.certificates import MUTUAL, common_name
from rbxcompose.compiler.systems.cut_link import lease_of
from rbxcompose.compiler.systems.model import PlacedRobot, System
from rbxcompose.compiler.systems.share import network_endpoint
from rbxcompose.compiler.systems.traffic import Crossing, TopicEnd
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Port, Serves, ServesAction

T = TypeVar("T")
TAKEN_BY: Mapping[type[Port[Any]], type[Port[Any]]] = {Out: In, Serves: Calls, ServesAction: CallsAction}
"""What gives something, and what takes that; of a topic, a service and an action with one name, the first is shared."""


def shared_name(robot: str, name: str) -> str:
    """Return the name under which others see a topic, service or action of a robot, as `share` has it."""
    return f"/{robot}/{name.strip('/')}"


def givers_of(robot: PlacedRobot, name: str) -> list[TopicEnd]:
    """Return the ends that publish or serve what has this absolute name: its publishers, else its servers."""
    there = [end for end in robot.ends if end.topic == name]
    found = ([topic_end for topic_end in there if isinstance(topic_end.end.port, giving)] for giving in TAKEN_BY)
    return next((ends for ends in found if ends), [])


def full_name(robot: PlacedRobot, name: str) -> str:
    """Return the absolute name of what is written in `share` of a robot."""
    return resolve(name, robot.plan.bus.namespace)


def is_called(giver: TopicEnd) -> bool:
    """Return whether what is given is a service or an action."""
    return isinstance(giver.end.port, Serves | ServesAction)


def may_call(giver: PlacedRobot, taker: PlacedRobot) -> bool:
    """Return whether a robot may call the services, and send goals to the actions, that another one shares."""
    return bool({*giver.model.callers} & taker.labels)


def takers_of(system: System) -> dict[str, list[tuple[PlacedRobot, TopicEnd]]]:
    """Return who subscribes or calls, by name."""
    found: dict[str, list[tuple[PlacedRobot, TopicEnd]]] = {}
    for robot in system.robots.values():
        for topic_end in robot.ends:
            if isinstance(topic_end.end.port, tuple(TAKEN_BY.values())):
                found.setdefault(topic_end.topic, []).append((robot, topic_end))
    return found


def endpoint_for(system: System, robot: PlacedRobot, host: str, *, is_local: bool) -> str:
    """Return where a host offers what a robot shares, for its own host or for others; empty if it has no address."""
    if is_local:
        return tcp_endpoint(robot.share_port)
    return network_endpoint(system, host, robot.share_port) if system.hosts[host].address else ""


def shared_crossings(system: System) -> Iterator[Crossing]:
    """Yield what passes between robots, under the name that others know."""
    takers = takers_of(system)
    for giver, name, first in _offers(system):
        shared = shared_name(giver.name, name)
        ends = [pair for pair in takers.get(shared, ()) if _is_carried(giver, first, *pair)]
        if ends:
            taking = tuple(_of(robot, end) for robot, end in ends)
            yield Crossing(shared, first.type, (_of(giver, first).end,), tuple(topic_end.end for topic_end in taking))


def _of(robot: PlacedRobot, topic_end: TopicEnd) -> TopicEnd:
    """Return an end whose component is named with its robot."""
    return replace(topic_end, end=replace(topic_end.end, component=f"{topic_end.end.component} of {robot.name}"))


def exchange_of(system: System, robot: PlacedRobot, host: str) -> Exchange | None:
    """Return what a host carries between a robot and others; None if it is nothing."""
    return exchanges(system).get((robot.name, host))


def exchanges(system: System) -> dict[tuple[str, str], Exchange]:
    """Return what hosts carry between robots, by robot and host."""
    found: dict[tuple[str, str], Exchange] = {}

    def add(robot: PlacedRobot, host: str, more: Exchange) -> None:
        old = found.get((robot.name, host), Exchange())
        found[robot.name, host] = Exchange(
            _joined(old.listen, more.listen),
            _joined(old.connect, more.connect),
            _joined(old.gives, more.gives),
            _joined(old.takes, more.takes),
            access=_merged((*old.access, *more.access)),
            lease=min(old.lease, more.lease),
        )

    takers = takers_of(system)
    for giver, name, first in _offers(system):
        shared, host = shared_name(giver.name, name), first.end.host
        lease = lease_of(giver, is_shared=True)
        for taker, end in takers.get(shared, ()):
            there = end.end.host
            endpoint = endpoint_for(system, giver, host, is_local=host == there)
            if endpoint and _is_carried(giver, first, taker, end):
                given, taken = _shared(first, first.topic, shared), _shared(first, shared, shared)
                lets, asks = tuple[HostAccess, ...](), tuple[HostAccess, ...]()
                if system.security == MUTUAL and host != there:
                    lets = (HostAccess(common_name(system.name, there), (), (given.pattern,), ()),)
                    asks = (HostAccess(common_name(system.name, host), (given.pattern,), (), ()),)
                add(giver, host, Exchange(listen=(endpoint,), gives=(given,), access=lets, lease=lease))
                add(taker, there, Exchange(connect=(endpoint,), takes=(taken,), access=asks, lease=lease))
    return found


def _is_carried(giver: PlacedRobot, first: TopicEnd, taker: PlacedRobot, end: TopicEnd) -> bool:
    """Return whether an end gets what another robot gives: it is of the same kind, and may call it."""
    kinds = next(taking for giving, taking in TAKEN_BY.items() if isinstance(first.end.port, giving))
    is_allowed = not is_called(first) or may_call(giver, taker)
    return taker is not giver and isinstance(end.end.port, kinds) and is_allowed


def _joined(one: tuple[T, ...], other: tuple[T, ...]) -> tuple[T, ...]:
    return tuple(dict.fromkeys((*one, *other)))


def _merged(hosts: tuple[HostAccess, ...]) -> tuple[HostAccess, ...]:
    found: dict[str, HostAccess] = {}
    for host in hosts:
        old = found.get(host.certificate, HostAccess(host.certificate, (), (), ()))
        found[host.certificate] = replace(
            old, gives=_joined(old.gives, host.gives), takes=_joined(old.takes, host.takes)
        )
    return tuple(found.values())


def _shared(giver: TopicEnd, own: str, shared: str) -> SharedWire:
    qos = str(giver.end.port.qos) if isinstance(giver.end.port, Out) else ""
    return SharedWire(own, shared, giver.type, qos)


def _offers(system: System) -> Iterator[tuple[PlacedRobot, str, TopicEnd]]:
    """Yield what is shared: the robot, the name as written, and the first that publishes or serves it."""
    for robot in system.robots.values():
        for name in robot.model.share:
            if (first := next(iter(givers_of(robot, full_name(robot, name))), None)) is not None:
                yield robot, name, first
