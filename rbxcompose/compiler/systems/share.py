"""The share of a host: the plan with what it runs, its links, and what others can reach and may do there. Pure.

Robots of a system let each other see and call what they share, under the name of the robot, and nothing else. The host
of who publishes or serves it offers it at a port of its own. The host of each component of another robot that takes it
fetches it from there, and gives it to the bus of its robot.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.endpoints import LOOPBACK, is_private, tcp_endpoint
from rbxcompose.compiler.model.robot import resolve
from rbxcompose.compiler.plan.model import Exchange, HostAccess, OtherHost, Plan, Share, SharedWire
from rbxcompose.compiler.systems.certificates import MUTUAL, NO_SECURITY, common_name
from rbxcompose.compiler.systems.cut_link import lease_of
from rbxcompose.compiler.systems.model import Crossing, PlacedRobot, System, TopicEnd
from rbxcompose.compiler.systems.neighbours import with_fleet
from rbxcompose.manifest.system_file import PRIORITIES, LinkModel
from rbxcompose.sdk.capabilities import RunsMissions, ServesPage
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Port, Qos, Serves, ServesAction
from rbxcompose.sdk.registry import declared

PARAMETERS = (
    "list_parameters",
    "get_parameters",
    "get_parameter_types",
    "describe_parameters",
    "set_parameters",
    "set_parameters_atomically",
    "change_parameters",
)
"""Services of each component."""
OF_RUNTIME = ("/diagnostics", "/rosout", "/parameter_events", "/tf", "/tf_static")


def access_of(system: System, robot: PlacedRobot, host: str, other: str) -> HostAccess:
    """Return what a host's router lets another host do."""
    gives = {topic for crossing in robot.crossings if _goes(crossing, other, host) for topic in _names(crossing)}
    takes = {topic for crossing in robot.crossings if _goes(crossing, host, other) for topic in _names(crossing)}
    gives |= set(_parameters(robot, other))
    takes |= set(_parameters(robot, host))
    return HostAccess(common_name(system.name, other), tuple(sorted(gives)), tuple(sorted(takes)), OF_RUNTIME)


def _parameters(robot: PlacedRobot, host: str) -> Iterator[str]:
    """Yield the services by which the parameters of a host's components are read and changed."""
    for name in (instance.name for instance in robot.plan.instances if robot.hosts[instance.name] == host):
        yield from (resolve(f"{name}/{service}", robot.plan.bus.namespace) for service in PARAMETERS)


def _goes(crossing: Crossing, giver: str, taker: str) -> bool:
    return any(end.host == giver for end in crossing.givers) and any(end.host == taker for end in crossing.takers)


def _names(crossing: Crossing) -> Iterable[str]:
    """Return the topics and services of a crossing; those of an action by their common pattern."""
    is_action = any(isinstance(end.port, ServesAction | CallsAction) for end in (*crossing.givers, *crossing.takers))
    return (f"{crossing.topic}/_action/*",) if is_action else (crossing.topic,)


V = TypeVar("V")
LONGEST = 1.0  # [s] that a message may take a link with a known limit


def hosts_of(system: System, robot: PlacedRobot) -> list[str]:
    """Return the hosts that run anything of a robot, in the order of the system's file."""
    return [host for host in system.hosts if host in robot.hosts.values()]


def robots_on(system: System, host: str) -> list[PlacedRobot]:
    """Return the robots of which a host runs anything."""
    return [robot for robot in system.robots.values() if host in robot.hosts.values()]


def share_of(system: System, robot: PlacedRobot, host: str) -> Plan:
    """Return what a host runs of a robot; a robot on this host alone has no share.

    Instances keep the order of the whole plan. It lets each host activate its own in turn, and none waits in a circle:
    the first component of the whole order that is not active yet waits for nothing.
    """
    plan, hosts = robot.plan, robot.hosts
    others = [other for other in hosts_of(system, robot) if other != host]
    if not others:
        return with_fleet(system, robot, host, plan)
    mine = tuple(instance for instance in plan.instances if hosts[instance.name] == host)
    runs_missions = any(declared(instance.type, instance.config, RunsMissions) for instance in mine)
    share = Share(
        host,
        tuple(_other(system, robot, other) for other in others),
        tuple(listens(system, robot, host)),
        tuple(_connects(system, robot, host)),
        robot.version,
        access=tuple(access_of(system, robot, host, other) for other in others) if system.security == MUTUAL else (),
        downsample=downsampled(system, robot, host),
        priorities=priorities(system, robot, host),
        largest=largest(system, robot, host),
        lease=lease_of(robot, is_shared=False),
    )
    mine_alone = replace(plan, instances=mine, start=plan.start if runs_missions else None, share=share)
    return with_fleet(system, robot, host, mine_alone)


def downsampled(system: System, robot: PlacedRobot, host: str) -> dict[str, float]:
    """Return how often topics of a robot that a host gives may cross [Hz]; of several links, the fastest counts."""
    return _of_links(system, robot, host, lambda link: link.downsample, max)


def priorities(system: System, robot: PlacedRobot, host: str) -> dict[str, str]:
    """Return how important topics of a robot are that a host gives; of several links, the highest counts."""
    return _of_links(system, robot, host, lambda link: link.priorities, lambda *some: min(some, key=PRIORITIES.index))


def largest(system: System, robot: PlacedRobot, host: str) -> dict[str, int]:
    """Return the largest messages of states and of bulk that may cross [bytes]; of several links, the widest counts."""
    found: dict[str, int] = {}
    for crossing in robot.crossings:
        if crossing.qos in (Qos.STATE, Qos.BULK) and any(end.host == host for end in crossing.givers):
            links = [_link_of(system, host, other) for other in {end.host for end in crossing.takers} - {host}]
            limits = [link.limit if link and link.limit is not None else math.inf for link in links]
            if (widest := max(limits, default=math.inf)) < math.inf:
                found[crossing.topic] = int(widest * LONGEST / 8)
    return found


def _of_links(
    system: System,
    robot: PlacedRobot,
    host: str,
    rules: Callable[[LinkModel], Mapping[str, V]],
    choose: Callable[[V, V], V],
) -> dict[str, V]:
    given = {crossing.topic for crossing in robot.crossings if any(end.host == host for end in crossing.givers)}
    found: dict[str, V] = {}
    for link in system.links.values():
        for name, rule in rules(link).items() if host in link.between else ():
            if (topic := resolve(name, robot.plan.bus.namespace)) in given:
                found[topic] = choose(rule, found.get(topic, rule))
    return found


def _link_of(system: System, text: str, other: str) -> LinkModel | None:
    return next((link for link in system.links.values() if {*link.between} == {text, other}), None)


def _other(system: System, robot: PlacedRobot, host: str) -> OtherHost:
    there = tuple(instance for instance in robot.plan.instances if robot.hosts[instance.name] == host)
    return OtherHost(host, there, system.hosts[host].optional)


def listens(system: System, robot: PlacedRobot, host: str) -> Iterator[str]:
    """Yield where the router of a host listens, if others dial it."""
    pairs = [pair for pair, dialled in _dialled(system, robot).items() if dialled == host]
    yield from dict.fromkeys(link_endpoint(system, robot, host, pair) for pair in pairs)


def _connects(system: System, robot: PlacedRobot, host: str) -> Iterator[str]:
    """Yield the routers that the router of a host dials."""
    for pair, dialled in _dialled(system, robot).items():
        if host in pair and dialled != host and system.hosts[dialled].address is not None:
            yield link_endpoint(system, robot, dialled, pair)


def _dialled(system: System, robot: PlacedRobot) -> dict[tuple[str, str], str]:
    """Return for each two hosts of a robot the one that the other dials: the first one that has an address."""
    hosts = hosts_of(system, robot)
    pairs = [(host, other) for index, host in enumerate(hosts) for other in hosts[index + 1 :]]
    return {pair: pair[0] if system.hosts[pair[0]].address else pair[1] for pair in pairs}


def link_endpoint(system: System, robot: PlacedRobot, host: str, pair: tuple[str, str]) -> str:
    """Return the endpoint at which a host's router takes that of the other of a pair; the host has an address."""
    link = _link_of(system, *pair)
    return network_endpoint(system, host, robot.link_port, link.protocol if link else "tcp")


def network_endpoint(system: System, host: str, port: int, protocol: str = "tcp") -> str:
    """Return an endpoint for other hosts at the address of a host, which has one; `protocol` is that of its link."""
    address = system.hosts[host].address or ""
    word = "tcp" if system.security == NO_SECURITY else protocol.replace("tcp", "tls")
    return f"{word}/{f'[{address}]' if ':' in address else address}:{port}"


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


NETWORK = "every machine of the network"
_PROOFS = {
    NO_SECURITY: ("no proof asked", True),
    "tls": ("encrypted, but no proof asked of who dials", True),
    MUTUAL: ("a certificate of this system", False),
}


@dataclass(frozen=True, slots=True)
class ListeningEndpoint:
    """An endpoint that takes connections on a host: who may reach it, and how they prove who they are."""

    host: str
    robot: str
    endpoint: str
    reached_by: str
    proof: str
    is_open: bool  # to strangers


@dataclass(frozen=True, slots=True)
class ReachableKey:
    """A topic, service or action of a robot on a host, and who may write or call it there."""

    host: str
    robot: str
    name: str
    written_by: tuple[str, ...]
    is_open: bool  # to strangers


@dataclass(frozen=True, slots=True)
class OpenedEndpoints:
    """What a robot that is up has opened on a host: its ports may be others than planned, if those were taken."""

    router: str
    pages: tuple[ServesPage, ...]


def _planned(robot: PlacedRobot, host: str) -> OpenedEndpoints:
    bus, mine = robot.plan.bus, (one for one in robot.plan.instances if robot.hosts[one.name] == host)
    pages = (page for one in mine for page in declared(one.type, one.config, ServesPage))
    return OpenedEndpoints(tcp_endpoint(bus.port) if bus.access == "machine" else "", tuple(pages))


def listeners(
    system: System, opened: Mapping[tuple[str, str], OpenedEndpoints] = MappingProxyType({})
) -> Iterator[ListeningEndpoint]:
    """Yield what listens on each host of a system: what is `opened` there, by robot and host, else what is planned."""
    for robot in system.robots.values():
        for host in hosts_of(system, robot):
            here, there = f"programs of {host}", opened.get((robot.name, host)) or _planned(robot, host)
            if robot.plan.bus.router is None and there.router and not is_private(there.router):
                yield ListeningEndpoint(host, robot.name, there.router, here, "no proof asked", False)
            elif robot.plan.bus.router is None:
                yield ListeningEndpoint(host, robot.name, "sockets in its folder", here, "the same user", False)
            yield ListeningEndpoint(host, robot.name, "control socket in its folder", here, "the same user", False)
            for page in there.pages:
                is_lan, what = page.listen.value == "lan", "for the console and rosbridge"
                whom = f"machines of the network, {what}" if is_lan else f"{here}, {what}"
                proof = "the token of a role, not encrypted" if is_lan else "no proof asked"
                at = f"http://{'*' if is_lan else LOOPBACK}:{page.port.value}"
                yield ListeningEndpoint(host, robot.name, at, whom, proof, False)
                if page.foxglove.value:
                    at, whom = f"ws://{LOOPBACK}:{page.foxglove.value}", f"{here}, for Foxglove"
                    yield ListeningEndpoint(host, robot.name, at, whom, "no proof asked", False)
            for endpoint in listens(system, robot, host):
                yield ListeningEndpoint(
                    host, robot.name, endpoint, "machines of the network", *_PROOFS[system.security]
                )
            exchange = exchange_of(system, robot, host)
            for endpoint in exchange.listen if exchange else ():
                if endpoint.startswith("tcp/127."):
                    words = f"{here}, for what is shared", "no proof asked", False
                else:
                    words = "machines of the network, for what is shared", *_PROOFS[system.security]
                yield ListeningEndpoint(host, robot.name, endpoint, *words)


def reachable_keys(system: System) -> Iterator[ReachableKey]:
    """Yield what a host takes from other hosts and robots, and who may write or call it.

    This is least privilege only with `mtls`.
    """
    for robot in system.robots.values():
        for host in hosts_of(system, robot) if len(hosts_of(system, robot)) > 1 else ():
            others = [other for other in hosts_of(system, robot) if other != host]
            taken = {crossing.topic: crossing for crossing in robot.crossings}
            for name in (*sorted(taken), *(text for text in OF_RUNTIME if text not in taken)):
                writers = [other for other in others if _may_write(system, robot, host, other, name)]
                if writers:
                    whom = tuple(f"host '{writer}'" for writer in writers) if system.security == MUTUAL else (NETWORK,)
                    yield ReachableKey(host, robot.name, name, whom, system.security != MUTUAL)
    yield from _called_keys(system)


def _called_keys(system: System) -> Iterator[ReachableKey]:
    """Yield the services and actions that are shared, and who may call them where they are offered."""
    for crossing in shared_crossings(system):
        host, away = crossing.givers[0].host, sorted({end.host for end in crossing.takers} - {crossing.givers[0].host})
        if crossing.qos is None:
            proven = system.security == MUTUAL or not away
            whom = tuple(f"host '{other}'" for other in away) if proven else (NETWORK,)
            yield ReachableKey(host, crossing.topic.split("/")[1], crossing.topic, whom, not proven)


def _may_write(system: System, robot: PlacedRobot, host: str, other: str, name: str) -> bool:
    access, names = access_of(system, robot, host, other), (name, f"{name}/_action/*")
    called = {crossing.topic for crossing in robot.crossings if crossing.qos is None}
    return any(one in (*access.gives, *access.both) or (name in called and one in access.takes) for one in names)
