"""The share of a host: the plan with what this host runs, and the links to the routers of the others. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TypeVar

from rbxcompose.manifest.system_file import PRIORITIES, LinkModel
from rbxcompose.model.wires import resolve
from rbxcompose.plan.model import OtherHost, Plan, Share
from rbxcompose.qos import Qos
from rbxcompose.sdk.capabilities import RunsMissions
from rbxcompose.sdk.registry import declared
from rbxcompose.systems.access import access_of
from rbxcompose.systems.certificates import MUTUAL, NO_SECURITY
from rbxcompose.systems.cut_link import lease_of
from rbxcompose.systems.model import PlacedRobot, System

V = TypeVar("V")
LONGEST = 1.0  # [s] that a message may take a link with a known limit


def hosts_of(system: System, robot: PlacedRobot) -> list[str]:
    """Return the hosts that run anything of a robot, in the order of the system's file."""
    return [host for host in system.hosts if host in robot.hosts.values()]


def robots_on(system: System, host: str) -> list[PlacedRobot]:
    """Return the robots of which a host runs anything."""
    return [one for one in system.robots.values() if host in one.hosts.values()]


def share_of(system: System, robot: PlacedRobot, host: str) -> Plan:
    """Return what a host runs of a robot; a robot on this host alone has no share.

    Instances keep the order of the whole plan. It lets each host activate its own in turn, and none waits in a circle:
    the first component of the whole order that is not active yet waits for nothing.
    """
    plan, hosts = robot.plan, robot.hosts
    others = [one for one in hosts_of(system, robot) if one != host]
    if not others:
        return plan
    mine = tuple(one for one in plan.instances if hosts[one.name] == host)
    runs_missions = any(declared(one.type, one.config, RunsMissions) for one in mine)
    share = Share(
        host,
        tuple(_other(system, robot, one) for one in others),
        tuple(listens(system, robot, host)),
        tuple(_connects(system, robot, host)),
        robot.version,
        access=tuple(access_of(system, robot, host, one) for one in others) if system.security == MUTUAL else (),
        downsample=downsampled(system, robot, host),
        priorities=priorities(system, robot, host),
        largest=largest(system, robot, host),
        lease=lease_of(robot, is_shared=False),
    )
    return replace(plan, instances=mine, start=plan.start if runs_missions else None, share=share)


def downsampled(system: System, robot: PlacedRobot, host: str) -> dict[str, float]:
    """Return how often topics of a robot that a host gives may cross [Hz]; of several links, the fastest counts."""
    return _of_links(system, robot, host, lambda link: link.downsample, max)


def priorities(system: System, robot: PlacedRobot, host: str) -> dict[str, str]:
    """Return how important topics of a robot are that a host gives; of several links, the highest counts."""
    return _of_links(system, robot, host, lambda link: link.priorities, lambda *some: min(some, key=PRIORITIES.index))


def largest(system: System, robot: PlacedRobot, host: str) -> dict[str, int]:
    """Return the largest messages of states and of bulk that may cross [bytes]; of several links, the widest counts."""
    found: dict[str, int] = {}
    for one in robot.crossings:
        if one.qos in (Qos.STATE, Qos.BULK) and any(end.host == host for end in one.givers):
            links = [_link_of(system, host, other) for other in {end.host for end in one.takers} - {host}]
            limits = [link.limit if link and link.limit is not None else math.inf for link in links]
            if (widest := max(limits, default=math.inf)) < math.inf:
                found[one.topic] = int(widest * LONGEST / 8)
    return found


def _of_links(
    system: System,
    robot: PlacedRobot,
    host: str,
    rules: Callable[[LinkModel], Mapping[str, V]],
    choose: Callable[[V, V], V],
) -> dict[str, V]:
    given = {one.topic for one in robot.crossings if any(end.host == host for end in one.givers)}
    found: dict[str, V] = {}
    for link in system.links.values():
        for name, rule in rules(link).items() if host in link.between else ():
            if (topic := resolve(name, robot.plan.bus.namespace)) in given:
                found[topic] = choose(rule, found.get(topic, rule))
    return found


def _link_of(system: System, one: str, other: str) -> LinkModel | None:
    return next((link for link in system.links.values() if {*link.between} == {one, other}), None)


def _other(system: System, robot: PlacedRobot, host: str) -> OtherHost:
    there = tuple(one for one in robot.plan.instances if robot.hosts[one.name] == host)
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
    pairs = [(one, other) for index, one in enumerate(hosts) for other in hosts[index + 1 :]]
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
