"""Which host runs which component, and why. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import field

from rbxcompose.dataclass import dataclass


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
    devices are connected to, then `on`. `parts` are the components of each part, `devices` those that each opens.
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
    for name in open_:
        if name in found:
            continue
        if wishes.on is not None:
            found[name] = _chosen(name, wishes.on, hosts, found, "the robot's host")
        elif len(hosts) == 1:
            found[name] = Placement(name, next(iter(hosts)), "the only host")
        else:
            found[name] = Placement(name, _main_host(hosts, found), "has most of the robot")
    return {name: found[name] for name in open_}


def _wish_of(name: str, wishes: Mapping[str, str], parts: Mapping[str, Collection[str]]) -> tuple[str, str] | None:
    """Return the key of the wish that counts for a component, and what it calls."""
    if name in wishes:
        return name, wishes[name]
    around = [part for part in wishes if name in parts.get(part, ())]
    return min(((part, wishes[part]) for part in around), key=lambda one: (len(parts[one[0]]), one), default=None)


def _chosen(
    name: str, called: str, hosts: Mapping[str, HostOffer], found: Mapping[str, Placement], reason: str
) -> Placement:
    """Return the place on the host of this name; of several with this label, on the one that has least to run."""
    candidates = hosts_called(called, hosts)
    if called in hosts:
        return Placement(name, called, reason)
    load = Counter(one.host for one in found.values())
    host = min(candidates, key=lambda one: load[one])  # the first one, if several are equal
    return Placement(name, host, f"{reason}, by label '{called}'")


def _hosts_with(devices: Collection[str], hosts: Mapping[str, HostOffer]) -> list[str]:
    """Return the hosts that all these devices are connected to; none if there are no devices."""
    return [name for name, facts in hosts.items() if devices and facts.devices.issuperset(devices)]


def _main_host(hosts: Mapping[str, HostOffer], found: Mapping[str, Placement]) -> str:
    load = Counter(one.host for one in found.values())
    return max(hosts, key=lambda one: load[one])
