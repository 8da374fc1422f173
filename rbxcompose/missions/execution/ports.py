"""The ports of the component that runs missions, for all that they request of the robot."""

from collections.abc import Iterable, Iterator
from typing import Any

from rbxcompose.missions.engine.world import POSE
from rbxcompose.missions.execution import errands
from rbxcompose.missions.sources import PAUSE, SkillSource, SkillWay
from rbxcompose.missions.triggers.trigger import Trigger
from rbxcompose.msgs import registry
from rbxcompose.msgs.std_msgs import String
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Port, Qos, SendsOrders

EVENTS = "mission/events"
TRIGGER = "trigger_"

Ports = Iterator[tuple[str, Port[Any]]]


def ports_for(equipment: errands.Equipment) -> dict[str, Port[Any]]:
    """Return a port for each value, skill, topic and service that is used, and for the pose if it is read."""
    return {name: port.named(name) for name, port in _ports(equipment)}


def ports_of_triggers(triggers: Iterable[Trigger]) -> dict[str, Port[Any]]:
    """Return a port for each trigger that a message causes."""
    named = {f"{TRIGGER}{one.name}": one for one in triggers if one.topic}
    return {
        name: In(registry.message(one.message), one.topic, qos=Qos.EVENT, may_be_silent=True).named(name)
        for name, one in named.items()
    }


def _ports(equipment: errands.Equipment) -> Ports:
    for name in sorted(equipment.reads & equipment.values.keys()):
        source = equipment.values[name]
        yield (
            errands.VALUE + name,
            In(registry.message(source.message), source.topic, qos=Qos.LATCHED if source.is_latched else Qos.STATE),
        )
    for name, skill in equipment.used.items():
        yield from _of_skill(name, skill)
    for topic, target in equipment.topics.items():
        yield errands.port_name(errands.PUBLISHES, topic), Out(registry.message(target.message), topic, qos=target.qos)
    for name, service in equipment.services.items():
        yield errands.port_name(errands.CALLS, name), Calls(registry.service(service), name)
    if POSE in equipment.reads:
        yield POSE, Looks(source="base_footprint", target="map")
    if equipment.programs:
        yield errands.port_name(errands.PUBLISHES, EVENTS), Out(String, EVENTS, qos=Qos.EVENT)


def _of_skill(name: str, source: SkillSource) -> Ports:
    match source.way:
        case SkillWay.SERVICE:
            yield errands.SKILL + name, Calls(registry.service(source.action), source.topic)
        case SkillWay.ACTION:
            yield errands.SKILL + name, CallsAction(registry.action(source.action), source.topic)
            if source.skill.pausable:
                yield errands.PAUSES + name, Calls(SetBool, f"{source.topic}/{PAUSE}")
        case SkillWay.TOPIC:
            orders, message = source.orders, registry.message(source.action)
            yield errands.SKILL + name, SendsOrders(message, source.topic, servers=orders.servers, qos=orders.qos)
            if (ends := orders.ends) is not None:
                yield (
                    errands.port_name(errands.ENDS, ends.topic),
                    In(registry.message(ends.message), ends.topic, qos=ends.qos),
                )
            if (halts := orders.halts) is not None:
                yield errands.HALTS + name, Out(registry.message(halts.message), halts.topic, qos=halts.qos)
