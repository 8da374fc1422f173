"""The share of a host: the plan with what it runs, its links, and what other hosts may do at its router."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TypeVar

from rbxcompose.compiler.model.robot import resolve
from rbxcompose.compiler.plan.model import HostAccess, OtherHost, Plan, Share
from rbxcompose.compiler.systems.certificates import MUTUAL, NO_SECURITY, common_name
from rbxcompose.compiler.systems.consoles import with_fleet
from rbxcompose.compiler.systems.cut_link import lease_of
from rbxcompose.compiler.systems.model import PlacedRobot, System
from rbxcompose.compiler.systems.traffic import Crossing
from rbxcompose.manifest.system_file import PRIORITIES, LinkModel
from rbxcompose.sdk.capabilities import RunsMissions
from rbxcompose.sdk.ports import CallsAction, Qos, ServesAction
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
