"""Component types by name; only the types that a manifest uses are imported."""

import inspect
from collections.abc import Callable
from typing import Any, TypeVar

from rbxcompose.base.config import Config
from rbxcompose.base.plugins import BrokenPluginError, Plugins
from rbxcompose.sdk.capabilities import Capability
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import Port, ServesTopic

T = TypeVar("T", bound=type[Component[Any]])
K = TypeVar("K", bound=Capability)

PLUGINS = Plugins("component", "components")
_TYPES: dict[str, type[Component[Any]]] = {}


def component(name: str) -> Callable[[T], T]:
    """Register a component class under the name of its type.

    Raises:
        TypeError: if it is not a subclass of `Component`.
        ValueError: if another class has this name, or one of its ports refers to a port that it does not have.
    """

    def register(cls: T) -> T:
        if not issubclass(cls, Component):
            raise TypeError(f"{cls.__module__}.{cls.__qualname__} is not a subclass of Component")
        other = _TYPES.get(name)
        if other is not None and (other.__module__, other.__qualname__) != (cls.__module__, cls.__qualname__):
            raise ValueError(f"two component types are named '{name}': {other.__module__} and {cls.__module__}")
        _require_ends(cls)
        cls.type_name = name
        _TYPES[name] = cls
        return cls

    return register


def _require_ends(cls: type[Component[Any]]) -> None:
    """Raise ValueError if orders are reported or halted at a port that the class does not have."""
    ports = [port for _, port in inspect.getmembers(cls) if isinstance(port, Port)]
    for port in ports:
        for word in ("ends", "halts") if isinstance(port, ServesTopic) else ():
            other = getattr(port, word)
            if other is not None and not any(other is one for one in ports):
                where = f"{cls.__module__}.{cls.__qualname__}"
                raise ValueError(f"{where}: '{word}' of the port '{port.name}' is not a port of this class")


def component_names() -> list[str]:
    """Return the names of all types, sorted, without importing any."""
    return sorted({*PLUGINS.names(), *_TYPES})


def component_type(name: str) -> type[Component[Any]]:
    """Return the class of a type, importing its file if necessary.

    Raises:
        KeyError: if no type has this name.
        BrokenPluginError: if it belongs to another package and cannot be used.
    """
    return PLUGINS.find(name, _TYPES, f"class by @component({name!r})")


def declared(name: str, config: Config, kind: type[K]) -> list[K]:
    """Return the capabilities of a kind that a component of type `name` has with this configuration."""
    return [capability for capability in component_type(name).capabilities(config) if isinstance(capability, kind)]


def usable_names() -> list[str]:
    """Import all types and return their names, sorted, without broken ones of other packages."""
    return [name for name in component_names() if _is_usable(name)]


def types_with(port: type[Port[Any]], topic: str, interface: str) -> list[str]:
    """Return the types of this project that users list and whose class has a port of this kind, topic and ROS type."""
    own = [name for name in component_names() if name not in PLUGINS.third_party]
    found = []
    for name in own:
        ports = [one for _, one in inspect.getmembers(component_type(name)) if isinstance(one, port)]
        fitting = (
            one.topic == topic and one.interface is not None and interface == one.interface.TYPE for one in ports
        )
        if any(fitting) and not component_type(name).made_by:
            found.append(name)
    return found


def _is_usable(name: str) -> bool:
    try:
        component_type(name)
    except BrokenPluginError:  # reported when a manifest uses it
        return False
    return True
