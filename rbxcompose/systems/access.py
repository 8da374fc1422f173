"""What other hosts may do at the router of a host: least privilege, computed from the declared ports. Pure.

A host may publish and serve what its components give to this one, and subscribe to and call what they take from it.
Besides, it may report, be probed, show tokens, and exchange what the runtime itself sends: diagnostics, frames, logs.
Programs of a host may read and change the parameters of components of another one, as those of the host itself may.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rbxcompose.model.wires import resolve
from rbxcompose.plan.model import HostAccess
from rbxcompose.sdk.ports import CallsAction, ServesAction
from rbxcompose.systems.certificates import common_name
from rbxcompose.systems.model import PlacedRobot, System
from rbxcompose.systems.traffic import Crossing

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
    gives = {topic for one in robot.crossings if _goes(one, other, host) for topic in _names(one)}
    takes = {topic for one in robot.crossings if _goes(one, host, other) for topic in _names(one)}
    gives |= set(_parameters(robot, other))
    takes |= set(_parameters(robot, host))
    return HostAccess(common_name(system.name, other), tuple(sorted(gives)), tuple(sorted(takes)), OF_RUNTIME)


def _parameters(robot: PlacedRobot, host: str) -> Iterator[str]:
    """Yield the services by which the parameters of a host's components are read and changed."""
    for name in (one.name for one in robot.plan.instances if robot.hosts[one.name] == host):
        yield from (resolve(f"{name}/{service}", robot.plan.bus.namespace) for service in PARAMETERS)


def _goes(one: Crossing, giver: str, taker: str) -> bool:
    return any(end.host == giver for end in one.givers) and any(end.host == taker for end in one.takers)


def _names(one: Crossing) -> Iterable[str]:
    """Return the topics and services of a crossing; those of an action by their common pattern."""
    is_action = any(isinstance(end.port, ServesAction | CallsAction) for end in (*one.givers, *one.takers))
    return (f"{one.topic}/_action/*",) if is_action else (one.topic,)
