"""The services that one component serves and calls: their keys, and the topics of their events."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rbxcompose.bus.names import ActionNames, data_key
from rbxcompose.bus.tokens import EntityKind, mangle
from rbxcompose.bus.wire import WIRE_PROFILES
from rbxcompose.msgs.action_msgs import CancelGoal
from rbxcompose.msgs.events import TOPIC
from rbxcompose.msgs.types import Service
from rbxcompose.plan.model import Instance, Plan
from rbxcompose.sdk.ports import Calls, CallsAction, Serves, ServesAction
from rbxcompose.sdk.registry import component_type

Known = tuple[str, type[Service[Any, Any]]]  # key on the bus, type


class ReplayedServices:
    """Maps the service events of a recording to the services of one component."""

    def __init__(self, plan: Plan, instance: Instance) -> None:
        wire = WIRE_PROFILES[plan.bus.wire]
        self._served = {name for one in plan.instances for name, _ in _ends(one, Serves, ServesAction)}
        self._known = {
            f"{name}/{TOPIC}": (data_key(plan.bus.domain, name, service.TYPE, wire.hash_of(service)), service)
            for name, service in _ends(instance, Serves, ServesAction, Calls, CallsAction)
        }

    def find(self, topic: str) -> Known | None:
        """Return the component's service whose events are on this topic, if any."""
        return self._known.get(topic)

    def is_served(self, pattern: str) -> bool:
        """Return whether a token pattern matches the servers of a service that the robot has."""
        is_server = f"/{EntityKind.SERVER}/" in pattern
        return is_server and any(f"/{mangle(name)}/" in pattern for name in self._served)


def _ends(instance: Instance, *kinds: type[Any]) -> Iterator[Known]:
    """Yield the name and type of each service behind ports of these kinds."""
    for name, port in component_type(instance.type).ports(instance.config).items():
        interface: Any = port.interface
        if not isinstance(port, kinds):
            continue
        topic = instance.topic(name)
        if isinstance(port, Serves | Calls):
            yield topic, interface
        else:
            names = ActionNames.of(topic)
            yield names.send_goal, interface.SendGoal
            yield names.get_result, interface.GetResult
            yield names.cancel_goal, CancelGoal
