"""The share of a host: the plan with what this host runs, and the links to the routers of the others. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from rbxcompose.model.wires import resolve
from rbxcompose.plan.model import OtherHost, Plan, Share
from rbxcompose.sdk.capabilities import RunsMissions
from rbxcompose.sdk.registry import declared
from rbxcompose.systems.access import access_of
from rbxcompose.systems.certificates import MUTUAL, NO_SECURITY
from rbxcompose.systems.model import PlacedRobot, System


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
    )
    return replace(plan, instances=mine, start=plan.start if runs_missions else None, share=share)


def downsampled(system: System, robot: PlacedRobot, host: str) -> dict[str, float]:
    """Return how often topics of a robot that a host gives may cross [Hz]; of several links, the fastest counts."""
    given = {one.topic for one in robot.crossings if any(end.host == host for end in one.givers)}
    found: dict[str, float] = {}
    for link in system.links.values():
        for name, rate in link.downsample.items() if host in link.between else ():
            if (topic := resolve(name, robot.plan.bus.namespace)) in given:
                found[topic] = max(rate, found.get(topic, 0.0))
    return found


def _other(system: System, robot: PlacedRobot, host: str) -> OtherHost:
    there = tuple(one for one in robot.plan.instances if robot.hosts[one.name] == host)
    return OtherHost(host, there, system.hosts[host].optional)


def listens(system: System, robot: PlacedRobot, host: str) -> Iterator[str]:
    """Yield where the router of a host listens, if another one dials it."""
    if any(dialled == host for dialled in _dialled(system, robot).values()):
        yield link_endpoint(system, robot, host)


def _connects(system: System, robot: PlacedRobot, host: str) -> Iterator[str]:
    """Yield the routers that the router of a host dials."""
    for pair, dialled in _dialled(system, robot).items():
        if host in pair and dialled != host and system.hosts[dialled].address is not None:
            yield link_endpoint(system, robot, dialled)


def _dialled(system: System, robot: PlacedRobot) -> dict[tuple[str, str], str]:
    """Return for each two hosts of a robot the one that the other dials: the first one that has an address."""
    hosts = hosts_of(system, robot)
    pairs = [(one, other) for index, one in enumerate(hosts) for other in hosts[index + 1 :]]
    return {pair: pair[0] if system.hosts[pair[0]].address else pair[1] for pair in pairs}


def link_endpoint(system: System, robot: PlacedRobot, host: str) -> str:
    """Return the endpoint at which a host's router takes those of others; the host has an address."""
    address = system.hosts[host].address or ""
    protocol = "tcp" if system.security == NO_SECURITY else "tls"
    return f"{protocol}/{f'[{address}]' if ':' in address else address}:{robot.link_port}"
