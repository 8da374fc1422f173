"""What viewers of ROS need to know of a plan: its topics, the frame of the whole, and where a person may drive."""

from collections.abc import Iterator
from operator import itemgetter
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.sdk.capabilities import Capability, Drains, Drives, Forwards, WritesFrame
from rbxcompose.sdk.ports import In, Out, Qos
from rbxcompose.sdk.registry import component_type

TWIST = "geometry_msgs/msg/Twist"


@dataclass(frozen=True, slots=True)
class ViewedTopic:
    """A topic of a robot."""

    name: str
    type: str
    qos: Qos


@dataclass(frozen=True, slots=True)
class DrivenTopic:
    """A topic at which a person may drive, and what the base takes at most [m/s, rad/s]."""

    name: str
    speed: float
    turn_rate: float


def sent(plan: Plan) -> dict[str, ViewedTopic]:
    """Return the topics that the robot sends, by their names."""
    return _topics(plan, Out)


def heard(plan: Plan) -> dict[str, ViewedTopic]:
    """Return the topics that the robot listens to, by their names."""
    return _topics(plan, In)


def _topics(plan: Plan, kind: type[In[Any]] | type[Out[Any]]) -> dict[str, ViewedTopic]:
    found = (
        (wire.topic, ViewedTopic(wire.topic, port.interface.TYPE if port.interface else "", port.qos))
        for instance in plan.everywhere
        for ports in (component_type(instance.type).ports(instance.config),)
        for wire in instance.wires
        if isinstance(port := ports.get(wire.port), kind) and wire.topic
    )
    return dict(sorted(found, key=itemgetter(0)))


def fixed_frame(plan: Plan) -> str:
    """Return the frame that no other is the parent of."""
    frames = [each for _, each in _declared(plan) if isinstance(each, WritesFrame)]
    written = {each.child.value: each.parent.value for each in frames}
    roots = [parent for parent in written.values() if parent not in written]
    return roots[0] if roots else "base_link"


def levels(plan: Plan) -> list[str]:
    """Return the topics with the charge of each battery, a number in the field `data`."""
    return [topic_of(each.level) for topic_of, each in _declared(plan) if isinstance(each, Drains)]


def driven(plan: Plan) -> DrivenTopic | None:
    """Return where a person may drive by velocities: a free input of the mux before the base, else the base's own."""
    bases = [(topic_of(each.commands), each) for topic_of, each in _declared(plan) if isinstance(each, Drives)]
    taken, known = sent(plan), heard(plan)
    muxes = {
        topic_of(each.output): [topic_of(port) for port in each.inputs]
        for topic_of, each in _declared(plan)
        if isinstance(each, Forwards)
    }
    for commands, base in bases:
        for topic in _inputs(commands, muxes, ()):
            if topic not in taken and topic in known and known[topic].type == TWIST:
                speeds = (base.max_speed, base.max_turn_rate)
                return DrivenTopic(topic, *(1.0 if most is None else most.value for most in speeds))
    return None


def _inputs(topic: str, muxes: dict[str, list[str]], seen: tuple[str, ...]) -> Iterator[str]:
    """Yield a topic, or the inputs of the mux that sends it, and of those before that one."""
    if topic not in muxes:
        yield topic
    elif topic not in seen:
        for other in muxes[topic]:
            yield from _inputs(other, muxes, (*seen, topic))


def _declared(plan: Plan) -> Iterator[tuple[Any, Capability]]:
    """Yield each capability, with what returns the topic at a port of its component."""
    for instance in plan.everywhere:
        for each in component_type(instance.type).capabilities(instance.config):
            yield instance.topic, each
