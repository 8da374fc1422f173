"""The plan: which instances run in which process group, wired how, started in which order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

from rbxcompose.base.config import DEFAULT, Bound, Config, Restart
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.bus.endpoints import LINK_LEASE
from rbxcompose.msgs import registry
from rbxcompose.sdk.ports import Port
from rbxcompose.sdk.registry import component_type

STEPPED_GROUP = "robot"  # the one process group of a robot on a stepped clock


@dataclass(frozen=True, slots=True)
class Wire:
    """One port of an instance and the topic, service or action (absolute ROS name) at its other end."""

    port: str
    kind: str
    topic: str
    type: str


@dataclass(frozen=True, slots=True)
class Instance:
    """One running thing: its type's name, validated configuration, process group and wires."""

    name: str
    type: str
    config: Config
    process: str
    starts_after: tuple[str, ...] = ()
    wires: tuple[Wire, ...] = ()
    restart: Restart = DEFAULT
    log: Level = Level.OK  # the lowest level that goes to the log
    bounds: Mapping[str, tuple[Bound, ...]] = field(default_factory=dict)  # of live settings, beside those of fields

    def topic(self, port: str) -> str:
        """Return the absolute name at a port.

        Raises:
            KeyError: if there is no such port.
        """
        for wire in self.wires:
            if wire.port == port:
                return wire.topic
        raise KeyError(port)


@dataclass(frozen=True, slots=True)
class BusPlan:
    """The robot's address and settings on the bus."""

    domain: int = 0
    namespace: str = ""
    port: int = 7447
    wire: str = "jazzy"
    router: str | None = None
    clock: str = "own"  # or `external`: robot time follows `/clock`
    access: str = "machine"  # or `user`: the robot's own router takes programs of this user only
    links: str = "direct"  # or `router`: its processes reach each other by the router only


@dataclass(frozen=True, slots=True)
class OtherHost:
    """Another host of the robot and what runs on it; `is_optional` means that the others start without it."""

    name: str
    instances: tuple[Instance, ...]
    is_optional: bool = False


@dataclass(frozen=True, slots=True)
class LinkTls:
    """The files by which a router proves who it is; if `mutual`, those that dial it must prove it, too."""

    authority: str
    certificate: str
    key: str
    mutual: bool = True

    @property
    def security(self) -> str:
        """Return the `security` of a system with such links."""
        return "mtls" if self.mutual else "tls"


@dataclass(frozen=True, slots=True)
class HostAccess:
    """What another host may do here, by the name in its certificate: topics and services that it gives and takes."""

    certificate: str
    gives: tuple[str, ...]
    takes: tuple[str, ...]
    both: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Share:
    """What one host runs of a robot that runs on several, and how its router is linked with those of the others."""

    host: str
    others: tuple[OtherHost, ...] = ()
    listen: tuple[str, ...] = ()  # endpoints for the routers of other hosts
    connect: tuple[str, ...] = ()  # endpoints of routers of other hosts
    version: str = ""  # of the files that the robot was compiled from; the same on all hosts
    tls: LinkTls | None = None
    access: tuple[HostAccess, ...] = ()  # with mutual TLS
    downsample: Mapping[str, float] = field(default_factory=dict)  # topic -> most messages per second that cross [Hz]
    priorities: Mapping[str, str] = field(default_factory=dict)  # topic -> high, medium or low, where it crosses
    largest: Mapping[str, int] = field(default_factory=dict)  # topic -> largest message that crosses [bytes]
    lease: float = LINK_LEASE  # [s] of silence after which another host is gone


@dataclass(frozen=True, slots=True)
class SharedWire:
    """A topic, service or action of a robot that other robots see under another name."""

    own: str  # its name on the robot's bus
    shared: str  # its name for other robots
    type: str
    qos: str = ""  # of a topic

    @property
    def pattern(self) -> str:
        """Return the name of all that it is made of for other robots: an action is services and topics."""
        return f"{self.shared}/_action/*" if "/action/" in self.type else self.shared


@dataclass(frozen=True, slots=True)
class Exchange:
    """What a host carries between its robot and others: nothing else passes. Robots fetch from each other directly."""

    listen: tuple[str, ...] = ()  # endpoints for robots that fetch
    connect: tuple[str, ...] = ()  # endpoints of robots to fetch from
    gives: tuple[SharedWire, ...] = ()
    takes: tuple[SharedWire, ...] = ()
    tls: LinkTls | None = None
    access: tuple[HostAccess, ...] = ()  # with mutual TLS; robots on this host are reached without it
    lease: float = LINK_LEASE  # [s] of silence after which other robots are gone


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that `up` needs; `instances` are in start order, on several hosts those of this one."""

    robot: str
    file: str
    instances: tuple[Instance, ...]
    bus: BusPlan = BusPlan()
    start: str | None = None  # the mission that starts by itself
    is_simulated: bool = True
    share: Share | None = None  # None: the robot runs on one host
    exchange: Exchange | None = None  # None: nothing is shared with other robots
    messages: Mapping[str, str] = field(default_factory=dict)  # texts of the robot's own message types, by name

    @property
    def everywhere(self) -> tuple[Instance, ...]:
        """Return the instances of all hosts; their order means nothing."""
        others = self.share.others if self.share else ()
        return (*self.instances, *(instance for other in others for instance in other.instances))

    @property
    def follows_clock(self) -> bool:
        """Return whether robot time comes from outside."""
        return self.bus.clock == "external"

    @property
    def groups(self) -> tuple[str, ...]:
        """Return the process groups, in the order in which their first instance starts."""
        return tuple(dict.fromkeys(instance.process for instance in self.instances))

    def of_group(self, group: str) -> tuple[Instance, ...]:
        """Return the instances of a process group in start order."""
        return tuple(instance for instance in self.instances if instance.process == group)

    def ports(self, instance: Instance) -> Mapping[str, Port[Any]]:
        """Return the ports of an instance by name; names of types mean those of this robot, not of one read later."""
        with registry.choosing(self.messages):
            return component_type(instance.type).ports(instance.config)

    def in_one_process(self) -> Plan:
        """Return the same robot with all instances in one process group, as a stepped clock requires."""
        return replace(self, instances=tuple(replace(instance, process=STEPPED_GROUP) for instance in self.instances))


def extent(components: int, processes: int) -> str:
    """Return the size of a robot in words: `2 components in 1 process`."""
    component, process = "component" if components == 1 else "components", "process" if processes == 1 else "processes"
    return f"{components} {component} in {processes} {process}"
