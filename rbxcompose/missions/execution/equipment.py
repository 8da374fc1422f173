"""What missions are given by the compiler, and the ports of the component that runs them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property
from typing import Annotated, Any, TypeVar

from pydantic import GetCoreSchemaHandler, WithJsonSchema
from pydantic_core import CoreSchema, core_schema

from rbxcompose.base.expressions.types import Type
from rbxcompose.missions.engine.world import POSE
from rbxcompose.missions.program.linker import Using
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.missions.sources import PAUSE, SkillSource, SkillWay, TopicSource, ValueSource, events_of
from rbxcompose.missions.triggers.trigger import Trigger
from rbxcompose.msgs import registry
from rbxcompose.msgs.std_msgs import String
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk import Config, Place, Replaceable
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Port, Qos, SendsOrders

T = TypeVar("T")


class IsInstance:
    """Takes an instance of the annotated class as it is.

    `pydantic.InstanceOf` also works out how each field of a dataclass would be read: 10 ms of each `check`.
    """

    def __get_pydantic_core_schema__(self, source: type, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.is_instance_schema(source)


Made = Annotated[T, IsInstance(), WithJsonSchema({"type": "object"})]  # made by the compiler, never by people


class MissionConfig(Config):
    """The robot's missions as the compiler has prepared them."""

    programs: Annotated[dict[str, Made[Program]], Replaceable()] = {}
    """Missions by name."""
    start: Annotated[str | None, Replaceable()] = None
    """The mission that starts by itself."""
    inputs: Annotated[dict[str, dict[str, Any]], Replaceable()] = {}
    """Values of the inputs, by mission and name."""
    after_crash: Annotated[dict[str, str], Replaceable()] = {}
    """What missions do after a crash, by mission: `restart`, `ask` or `continue`."""
    values: dict[str, Made[ValueSource]] = {}
    """Where the robot's values come from."""
    places: Annotated[dict[str, Made[Place]], Replaceable()] = {}
    """The robot's places."""
    skills: dict[str, Made[SkillSource]] = {}
    """The robot's skills."""
    topics: dict[str, Made[TopicSource]] = {}
    """The topics on which missions publish."""
    services: dict[str, str] = {}
    """The services that missions call, with their ROS types."""
    settings: dict[str, dict[str, Made[Type]]] = {}
    """The types of settings that missions change."""
    for_others: bool = False
    """Whether components run missions, by the action `run_mission`."""
    triggers: dict[str, Made[Trigger]] = {}
    """What starts missions by itself, by name."""

    @property
    def reads(self) -> frozenset[str]:
        """Return all names that missions and triggers read."""
        names = frozenset[str]().union(*(program.reads for program in self.programs.values()))
        return names.union(*(trigger.reads for trigger in self.triggers.values()))

    @property
    def used(self) -> dict[str, SkillSource]:
        """Return all skills that missions use."""
        names = {node.skill for program in self.programs.values() for node in program.nodes}
        return {name: self.skills[name] for name in sorted(names & self.skills.keys())}

    @cached_property
    def names(self) -> RobotNames:
        """Return what the robot offers to missions."""
        broken = Using(self.programs).broken
        return RobotNames(
            {name: source.type for name, source in self.values.items()},
            self.places,
            {name: source.skill for name, source in self.skills.items()},
            {name: program for name, program in self.programs.items() if name not in broken},
            {name: topic.message for name, topic in self.topics.items()},
            self.services,
            self.settings,
            events=events_of(self.values),
        )


# Prefixes of port names.
VALUE, PUBLISHES, CALLS = "value_", "publishes_", "calls_"
SKILL, PAUSES, ENDS, HALTS = "skill_", "pauses_", "ends_", "halts_"  # of a skill: requests, pauses, ends, cancels


def port_name(beginning: str, topic: str) -> str:
    """Return the name of the port for a topic or a service."""
    return beginning + topic.strip("/").replace("/", "_")


EVENTS = "mission/events"
TRIGGER = "trigger_"

Ports = Iterator[tuple[str, Port[Any]]]


def ports_for(equipment: MissionConfig) -> dict[str, Port[Any]]:
    """Return a port for each value, skill, topic and service that is used, and for the pose if it is read."""
    return {name: port.named(name) for name, port in _ports(equipment)}


def ports_of_triggers(triggers: Iterable[Trigger]) -> dict[str, Port[Any]]:
    """Return a port for each trigger that a message causes."""
    named = {f"{TRIGGER}{one.name}": one for one in triggers if one.topic}
    return {
        name: In(registry.message(one.message), one.topic, qos=Qos.EVENT, may_be_silent=True).named(name)
        for name, one in named.items()
    }


def _ports(equipment: MissionConfig) -> Ports:
    for name in sorted(equipment.reads & equipment.values.keys()):
        source = equipment.values[name]
        yield (
            VALUE + name,
            In(registry.message(source.message), source.topic, qos=Qos.LATCHED if source.is_latched else Qos.STATE),
        )
    for name, skill in equipment.used.items():
        yield from _of_skill(name, skill)
    for topic, target in equipment.topics.items():
        yield port_name(PUBLISHES, topic), Out(registry.message(target.message), topic, qos=target.qos)
    for name, service in equipment.services.items():
        yield port_name(CALLS, name), Calls(registry.service(service), name)
    if POSE in equipment.reads:
        yield POSE, Looks(source="base_footprint", target="map")
    if equipment.programs:
        yield port_name(PUBLISHES, EVENTS), Out(String, EVENTS, qos=Qos.EVENT)


def _of_skill(name: str, source: SkillSource) -> Ports:
    match source.way:
        case SkillWay.SERVICE:
            yield SKILL + name, Calls(registry.service(source.action), source.topic)
        case SkillWay.ACTION:
            yield SKILL + name, CallsAction(registry.action(source.action), source.topic)
            if source.skill.pausable:
                yield PAUSES + name, Calls(SetBool, f"{source.topic}/{PAUSE}")
        case SkillWay.TOPIC:
            orders, message = source.orders, registry.message(source.action)
            yield SKILL + name, SendsOrders(message, source.topic, servers=orders.servers, qos=orders.qos)
            if (ends := orders.ends) is not None:
                yield (port_name(ENDS, ends.topic), In(registry.message(ends.message), ends.topic, qos=ends.qos))
            if (halts := orders.halts) is not None:
                yield HALTS + name, Out(registry.message(halts.message), halts.topic, qos=halts.qos)
