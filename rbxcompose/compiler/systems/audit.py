"""What others can reach of a system: where it listens, and who may write or call what. Pure."""

from collections.abc import Iterator

from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.systems.certificates import MUTUAL, NO_SECURITY
from rbxcompose.compiler.systems.model import PlacedRobot, System
from rbxcompose.compiler.systems.share import OF_RUNTIME, access_of, exchange_of, hosts_of, listens, shared_crossings

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


def listeners(system: System) -> Iterator[ListeningEndpoint]:
    """Yield what listens on each host of a system."""
    for robot in system.robots.values():
        for host in hosts_of(system, robot):
            bus, here = robot.plan.bus, f"programs of {host}"
            if bus.router is None and bus.access == "machine":
                yield ListeningEndpoint(host, robot.name, f"tcp/127.0.0.1:{bus.port}", here, "no proof asked", False)
            elif bus.router is None:
                yield ListeningEndpoint(host, robot.name, "sockets in its folder", here, "the same user", False)
            yield ListeningEndpoint(host, robot.name, "control socket in its folder", here, "the same user", False)
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
