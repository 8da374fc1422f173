"""What passes the bridge: topics and services, as many for an action as that has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal, cast

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.names import ActionNames
from rbxcompose.msgs import rcl_interfaces
from rbxcompose.msgs.action_msgs import CancelGoal, GoalStatusArray
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Port, Qos, Serves, ServesAction

BridgeWay = Literal["from_ros", "to_ros"]
PARAMETERS: Mapping[str, Any] = {
    "get_parameters": rcl_interfaces.GetParameters,
    "set_parameters": rcl_interfaces.SetParameters,
    "set_parameters_atomically": rcl_interfaces.SetParametersAtomically,
    "list_parameters": rcl_interfaces.ListParameters,
    "describe_parameters": rcl_interfaces.DescribeParameters,
    "get_parameter_types": rcl_interfaces.GetParameterTypes,
}
"""The services of the parameters of a node."""


@dataclass(frozen=True, slots=True)
class BridgedEnd:
    """A topic or a service that passes; a service of ROS is asked `to_ros`, one of ours is asked `from_ros`."""

    name: str
    kind: Literal["topic", "service"]
    way: BridgeWay
    interface: Any
    qos: Qos = Qos.EVENT
    port: str = ""

    def for_ros(self, channel: int) -> dict[str, object]:
        """Return what the other side needs to know."""
        return {
            "channel": channel,
            "name": self.name,
            "kind": self.kind,
            "way": self.way,
            "type": self.interface.TYPE,
            "hash": self.interface.HASH,
            "depth": min(self.qos.depth, _DEEPEST),
            "latched": self.qos is Qos.LATCHED,
        }


_DEEPEST = 1000


def ends_of(port: Port[Any], name: str) -> Iterator[BridgedEnd]:
    """Yield what passes for a port of a ROS node, whose topic, service or action has this absolute name."""
    interface = cast(Any, port.interface)
    match port:
        case Out():
            yield BridgedEnd(name, "topic", "from_ros", interface, port.qos, port.name)
        case In():
            yield BridgedEnd(name, "topic", "to_ros", interface, port.qos, port.name)
        case Serves():
            yield BridgedEnd(name, "service", "to_ros", interface, port=port.name)
        case Calls():
            yield BridgedEnd(name, "service", "from_ros", interface, port=port.name)
        case ServesAction() | CallsAction():
            yield from _action(interface, ActionNames.of(name), serves=isinstance(port, ServesAction), port=port.name)


def _action(interface: Any, names: ActionNames, *, serves: bool, port: str) -> Iterator[BridgedEnd]:
    asks: BridgeWay = "to_ros" if serves else "from_ros"
    tells: BridgeWay = "from_ros" if serves else "to_ros"
    yield BridgedEnd(names.send_goal, "service", asks, interface.SendGoal, port=port)
    yield BridgedEnd(names.get_result, "service", asks, interface.GetResult, port=port)
    yield BridgedEnd(names.cancel_goal, "service", asks, CancelGoal, port=port)
    yield BridgedEnd(names.feedback, "topic", tells, interface.FeedbackMessage, Qos.EVENT, port)
    yield BridgedEnd(names.status, "topic", tells, GoalStatusArray, Qos.LATCHED, port)


def parameters_of(node: str, way: BridgeWay) -> Iterator[BridgedEnd]:
    """Yield the services of the parameters of a node with this absolute name."""
    for bare, service in PARAMETERS.items():
        yield BridgedEnd(f"{node}/{bare}", "service", way, service)
