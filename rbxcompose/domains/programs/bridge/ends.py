"""What a program of others has on a bus: topics and services, five of them for an action."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, cast

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.names import ActionNames
from rbxcompose.bus.tokens import EntityKind
from rbxcompose.domains.programs.watch import EndKind
from rbxcompose.msgs import rcl_interfaces
from rbxcompose.msgs.action_msgs import CancelGoal, GoalStatusArray
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Port, Qos, Serves, ServesAction

PARAMETERS: Mapping[str, Any] = {
    "get_parameters": rcl_interfaces.GetParameters,
    "set_parameters": rcl_interfaces.SetParameters,
    "set_parameters_atomically": rcl_interfaces.SetParametersAtomically,
    "list_parameters": rcl_interfaces.ListParameters,
    "describe_parameters": rcl_interfaces.DescribeParameters,
    "get_parameter_types": rcl_interfaces.GetParameterTypes,
}
"""The services of the parameters of a node."""
TOKENS: Mapping[EndKind, EntityKind] = {
    "publishes": EntityKind.PUBLISHER,
    "subscribes": EntityKind.SUBSCRIPTION,
    "serves": EntityKind.SERVER,
    "calls": EntityKind.CLIENT,
}
_KINDS: Mapping[type[Port[Any]], EndKind] = {Out: "publishes", In: "subscribes", Serves: "serves", Calls: "calls"}


@dataclass(frozen=True, slots=True)
class ProgramEnd:
    """A topic or a service by its absolute name, and what the program does there; `part` is which of an action's."""

    kind: EndKind
    name: str
    interface: Any
    qos: Qos = Qos.EVENT
    part: str = ""

    @property
    def is_topic(self) -> bool:
        """Return whether it is a topic."""
        return self.kind in ("publishes", "subscribes")


def ends_of(port: Port[Any], name: str) -> Iterator[ProgramEnd]:
    """Yield the ends of a port of a program, whose topic, service or action has this absolute name."""
    interface = cast(Any, port.interface)
    if not isinstance(port, ServesAction | CallsAction):
        yield ProgramEnd(_KINDS[type(port)], name, interface, port.qos if isinstance(port, Out | In) else Qos.EVENT)
        return
    asked: EndKind = "serves" if isinstance(port, ServesAction) else "calls"
    heard: EndKind = "publishes" if isinstance(port, ServesAction) else "subscribes"
    names = ActionNames.of(name)
    yield ProgramEnd(asked, names.send_goal, interface.SendGoal, part="send_goal")
    yield ProgramEnd(asked, names.get_result, interface.GetResult, part="get_result")
    yield ProgramEnd(asked, names.cancel_goal, CancelGoal, part="cancel_goal")
    yield ProgramEnd(heard, names.feedback, interface.FeedbackMessage, part="feedback")
    yield ProgramEnd(heard, names.status, GoalStatusArray, Qos.LATCHED, "status")


def parameters_of(node: str, kind: EndKind) -> Iterator[ProgramEnd]:
    """Yield the services of the parameters of a node with this absolute name, which a program serves or calls."""
    for bare, service in PARAMETERS.items():
        yield ProgramEnd(kind, f"{node}/{bare}", service)
