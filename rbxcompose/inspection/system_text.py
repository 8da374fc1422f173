"""A system for people: which host runs what and why, and what crosses between hosts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rbxcompose.bus.names import EXCHANGE_DOMAIN
from rbxcompose.inspection.wire_keys import keys_of
from rbxcompose.plan.model import BusPlan, extent
from rbxcompose.systems.cut_link import every_stop, stops_after_cut, stops_of_goals
from rbxcompose.systems.exchange import exchange_of, shared_crossings
from rbxcompose.systems.model import PlacedRobot, System
from rbxcompose.systems.share import hosts_of, robots_on, share_of
from rbxcompose.systems.traffic import Crossing
from rbxcompose.typed_json import to_data
from rbxcompose.units import BIT_RATE, FREQUENCY, TIME, format_quantity

_OPEN_TO = {
    "none": "open to every machine of the network",
    "tls": "encrypted, open to every machine of the network",
    "mtls": "for hosts of the system",
}


def system_extent(system: System) -> str:
    """Return the size of a system in words: `1 robot on 2 hosts`."""
    robots, hosts = len(system.robots), len(system.hosts)
    return f"{robots} robot{'s' if robots != 1 else ''} on {hosts} host{'s' if hosts != 1 else ''}"


def system_text(system: System, *, with_keys: bool = False) -> str:
    """Return what `up` would run on each host, why, and what would cross between hosts."""
    return "\n".join(_lines(system, with_keys))


def _lines(system: System, with_keys: bool) -> Iterator[str]:
    yield f"{system.name}: {system_extent(system)}"
    for host, facts in system.hosts.items():
        optional = ", the others start without it" if facts.optional else ""
        yield ""
        yield f"host {host}{f' at {facts.address}' if facts.address else ''}{optional}"
        for robot in robots_on(system, host):
            yield from (f"  {line}" for line in _share(system, robot, host))
        if not robots_on(system, host):
            yield "  nothing runs here"
    for robot in system.robots.values():
        if robot.crossings:
            yield ""
            yield f"between the hosts of {robot.name}"
            yield from (f"  {line}" for one in robot.crossings for line in _crossing(one, robot.plan.bus, with_keys))
        for _, stop in every_stop(robot):
            yield ""
            yield f"after the link is cut, {stop.text}; it may take {format_quantity(robot.model.stop_within, TIME)}"
    if shared := [*shared_crossings(system)]:
        yield ""
        yield "between robots"
        yield from (f"  {line}" for one in shared for line in _crossing(one, BusPlan(EXCHANGE_DOMAIN), with_keys))


def _share(system: System, robot: PlacedRobot, host: str) -> Iterator[str]:
    plan = share_of(system, robot, host)
    yield f"{robot.name}: {extent(len(plan.instances), len(plan.groups))}"
    if plan.share is not None:
        yield from (f"  its router listens at {one}, {_OPEN_TO[system.security]}" for one in plan.share.listen)
        yield from (f"  its router dials {one}" for one in plan.share.connect)
        for topic, rate in plan.share.downsample.items():
            yield f"  at most {format_quantity(rate, FREQUENCY)} of {topic} leave it"
        yield from (f"  {topic} leaves it with {word} priority" for topic, word in plan.share.priorities.items())
        yield from (f"  {topic} leaves it up to {size:,} bytes" for topic, size in plan.share.largest.items())
    if (exchange := exchange_of(system, robot, host)) is not None:
        yield from (f"  gives {one.own} to other robots as {one.shared}" for one in exchange.gives)
        yield from (f"  takes {one.shared} from another robot" for one in exchange.takes)
        yield from (f"  other robots fetch at {one}, {_open(system, one)}" for one in exchange.listen)
        yield from (f"  fetches at {one}" for one in exchange.connect)
    for group in plan.groups:
        yield f"  process {group}"
        yield from (f"    {one.name} ({one.type}): {robot.placed[one.name].reason}" for one in plan.of_group(group))


def _open(system: System, endpoint: str) -> str:
    return "open to programs of this machine" if endpoint.startswith("tcp/127.") else _OPEN_TO[system.security]


def _crossing(one: Crossing, bus: BusPlan, with_keys: bool) -> Iterator[str]:
    way = f"{_ends(one.givers)} -> {_ends(one.takers)}"
    yield f"{one.topic} ({one.type}{f', {one.qos}' if one.qos else ''}): {way}{_load(one)}"
    if with_keys:
        yield from (f"  {key}" for _, key in keys_of(one.givers[0].port, one.topic, bus))


def _ends(ends: tuple[Any, ...]) -> str:
    return ", ".join(f"{one.component} on {one.host}" for one in ends)


def _load(one: Crossing) -> str:
    if one.rate is None or one.bandwidth is None:
        return ""
    return f", about {format_quantity(one.rate, FREQUENCY)}, {format_quantity(one.bandwidth, BIT_RATE)}"


def system_data(system: System) -> dict[str, Any]:
    """Return the same as data for programs."""
    return {
        "system": system.name,
        "hosts": {name: _host(system, name) for name in system.hosts},
        "robots": {
            name: {
                "placed": {key: {"host": at.host, "reason": at.reason} for key, at in one.placed.items()},
                "hosts": hosts_of(system, one),
                "crossing": [_data(each) for each in one.crossings],
                "stops_after_cut": {each.base: each.time for each in stops_after_cut(one)},
                "stops_of_goals": {each.server: each.time for each in stops_of_goals(one)},
            }
            for name, one in system.robots.items()
        },
        "shared": [_data(one) for one in shared_crossings(system)],
    }


def _host(system: System, name: str) -> dict[str, Any]:
    shares = {one.name: share_of(system, one, name) for one in robots_on(system, name)}
    return {
        "address": system.hosts[name].address,
        "robots": {
            robot: {
                "processes": {group: [one.name for one in plan.of_group(group)] for group in plan.groups},
                "listen": list(plan.share.listen) if plan.share else [],
                "connect": list(plan.share.connect) if plan.share else [],
                "exchange": to_data(exchange_of(system, system.robots[robot], name)),
            }
            for robot, plan in shares.items()
        },
    }


def _data(one: Crossing) -> dict[str, Any]:
    return {
        "topic": one.topic,
        "type": one.type,
        "from": [{"component": end.component, "host": end.host} for end in one.givers],
        "to": [{"component": end.component, "host": end.host} for end in one.takers],
        "rate": one.rate,
        "bandwidth": one.bandwidth,
    }
