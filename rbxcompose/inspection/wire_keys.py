"""How an end of a wire appears on the bus: its data keys, and its quality-of-service class."""

from __future__ import annotations

from typing import Any

from rbxcompose.bus.names import ActionNames, data_key
from rbxcompose.bus.wire import WIRE_PROFILES
from rbxcompose.msgs.action_msgs import CancelGoal, GoalStatusArray
from rbxcompose.msgs.types import Interface
from rbxcompose.plan.model import BusPlan
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Port, Serves, ServesAction, ServesTopic

Keys = tuple[tuple[str, str], ...]  # its purpose, and the key


def keys_of(port: Port[Any], topic: str, bus: BusPlan) -> Keys:
    """Return the Zenoh keys of a port with this absolute topic; none for a look-up."""
    interface = port.interface
    if interface is None:
        return ()
    if isinstance(port, ServesAction | CallsAction):
        names = ActionNames.of(topic)
        return (
            ("send_goal", _key(names.send_goal, interface.SendGoal, bus)),
            ("get_result", _key(names.get_result, interface.GetResult, bus)),
            ("cancel_goal", _key(names.cancel_goal, CancelGoal, bus)),
            ("feedback", _key(names.feedback, interface.FeedbackMessage, bus)),
            ("status", _key(names.status, GoalStatusArray, bus)),
        )
    return (("data" if isinstance(port, In | Out) else "request", _key(topic, interface, bus)),)


def _key(name: str, interface: type[Interface], bus: BusPlan) -> str:
    return data_key(bus.domain, name, interface.TYPE, WIRE_PROFILES[bus.wire].hash_of(interface))


def qos_of(port: Port[Any]) -> str:
    """Return the class of a topic's end; nothing for services, actions and look-ups, which have none."""
    return str(port.qos) if isinstance(port, In | Out) else ""


def does(port: Port[Any]) -> str:
    """Return the verb phrase for what a component does at a port."""
    match port:
        case Out():
            return "sends"
        case ServesTopic():
            return "carries out"
        case In():
            return "takes"
        case Serves():
            return "answers"
        case ServesAction():
            return "carries out"
        case CallsAction():
            return "asks for"
        case Calls():
            return "calls"
    return "looks up"
