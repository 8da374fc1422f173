"""Ends of wires: the topic, service or action that each port of a component is connected to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbxcompose.config import Config
from rbxcompose.dataclass import dataclass
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import Port, Serves, ServesAction


@dataclass(frozen=True, slots=True)
class PortEnd:
    """A port of an instance, and its absolute ROS name; empty for a look-up."""

    instance: str
    name: str
    port: Port[Any]
    topic: str

    @property
    def type_name(self) -> str:
        """Return the ROS name of the port's type; empty for a look-up."""
        return self.port.interface.TYPE if self.port.interface else ""

    @property
    def skill(self) -> str:
        """Return the name that a skill served here has in missions; empty if they do not have it."""
        named = self.port.skill if isinstance(self.port, Serves | ServesAction) else ""
        return "" if named is None else named or self.topic.rpartition("/")[-1]


def resolve(topic: str, namespace: str) -> str:
    """Return a topic's absolute name: relative ones are in the robot's namespace."""
    if topic.startswith("/") or not topic:
        return topic
    return f"/{namespace.strip('/')}/{topic}" if namespace.strip("/") else f"/{topic}"


def ends_of(
    instance: str, cls: type[Component[Any]], config: Config, namespace: str, connect: Mapping[str, str]
) -> tuple[PortEnd, ...]:
    """Return the ends of an instance; `connect` gives ports a topic other than that of their type."""
    return tuple(
        PortEnd(instance, name, port, resolve(connect.get(name, port.topic), namespace))
        for name, port in sorted(cls.ports(config).items())
    )
