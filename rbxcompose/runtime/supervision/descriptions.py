"""What a component declares about itself, as data for pages and tools."""

import inspect
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

from rbxcompose.base.requests import Command
from rbxcompose.compiler.plan.model import Instance
from rbxcompose.runtime.requests import ComponentDescription, PortDescription
from rbxcompose.sdk.capabilities import Capability, Setting
from rbxcompose.sdk.parameters import si_unit
from rbxcompose.sdk.ports import In, Out, Port, Qos, Serves, ServesAction, ServesTopic
from rbxcompose.sdk.registry import component_type


def described(instance: Instance) -> ComponentDescription:
    """Return what a component of the plan declares."""
    cls = component_type(instance.type)
    ports = cls.ports(instance.config)
    capabilities: dict[str, tuple[Mapping[str, Any], ...]] = {}
    for one in cls.capabilities(instance.config):
        capabilities[type(one).__name__] = (*capabilities.get(type(one).__name__, ()), _plain_fields(one))
    return ComponentDescription(
        name=instance.name,
        type=instance.type,
        about=inspect.cleandoc(cls.__doc__ or "").partition("\n\n")[0].replace("\n", " "),
        process=instance.process,
        ports=tuple(
            _port(ports[wire.port], wire.port, wire.topic, wire.type) for wire in instance.wires if wire.port in ports
        ),
        capabilities=capabilities,
        requests={name: issubclass(taken, Command) for name, taken in cls.requests().types.items()},
    )


def _port(port: Port[Any], name: str, topic: str, type_: str) -> PortDescription:
    named = port.skill if isinstance(port, Serves | ServesAction) else "" if isinstance(port, ServesTopic) else None
    return PortDescription(
        name,
        port.kind,
        topic,
        type_,
        unit=port.unit if isinstance(port, In | Out | Serves) else "",
        skill="" if named is None else named or topic.rpartition("/")[-1],
        is_command=isinstance(port, In) and port.qos is Qos.COMMAND,
        claims=port.claims if isinstance(port, ServesTopic | ServesAction) else "",
        is_pausable=isinstance(port, ServesAction) and port.pausable,
        measures=_units(port.measures) if isinstance(port, ServesAction) else {},
        choices={key: tuple(words) for key, words in port.choices.items()} if isinstance(port, ServesAction) else {},
        outcomes=dict(port.outcomes) if isinstance(port, ServesTopic | ServesAction) else {},
    )


def _units(measures: Mapping[str, Any]) -> dict[str, Any]:
    return {key: _units(one) if isinstance(one, Mapping) else si_unit(one) for key, one in measures.items()}


def _plain_fields(capability: Capability) -> dict[str, Any]:
    """Return the fields of a capability, those that JSON can hold; of a setting, its value."""
    values = ((field.name, getattr(capability, field.name)) for field in fields(capability))
    return {name: _plain(value.value if isinstance(value, Setting) else value) for name, value in values}


def _plain(value: Any) -> Any:
    match value:
        case bool() | int() | str() | None:
            return value
        case float():
            return value if math.isfinite(value) else None
        case Enum():
            return value.value
        case Mapping():
            return {str(key): _plain(entry) for key, entry in value.items()}
        case list() | tuple():
            return [_plain(entry) for entry in value]
    return _plain({field.name: getattr(value, field.name) for field in fields(value)}) if is_dataclass(value) else None
